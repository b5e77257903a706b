//! The crates as their manifests describe them.

use super::graph::{CrateGraph, CrateKind, CrateNode, Use};
use anyhow::{Context, ensure};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The package that composes the others; the names of the others begin with it and a dash.
const PRODUCT: &str = "hwall";
const TEST_KIT: &str = "hwall-testkit";

#[derive(Deserialize)]
struct Manifest {
    package: Package,
    #[serde(default)]
    dependencies: BTreeMap<String, Dependency>,
    #[serde(default, rename = "dev-dependencies")]
    dev_dependencies: BTreeMap<String, Dependency>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    #[serde(default)]
    description: String,
    publish: Option<bool>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Dependency {
    Detailed {
        #[serde(default)]
        optional: bool,
    },
    Version(#[allow(dead_code)] String),
}

impl Dependency {
    const fn is_optional(&self) -> bool {
        matches!(self, Self::Detailed { optional: true })
    }
}

/// Reads `crates/*`, `examples` and `tests` below the root of the project. Of the last two, which hold nothing else, the
/// dev-dependencies count.
///
/// # Errors
/// A manifest that cannot be read.
pub fn read(root: &Path) -> anyhow::Result<CrateGraph> {
    let folder = root.join("crates");
    let context = || folder.display().to_string();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .with_context(context)?
        .map(|entry| entry.map(|entry| entry.path().join("Cargo.toml")))
        .collect::<Result<_, _>>()
        .with_context(context)?;
    paths.retain(|path| path.is_file());
    paths.extend(["examples", "tests"].map(|name| root.join(name).join("Cargo.toml")));
    let mut manifests: Vec<Manifest> = paths
        .iter()
        .map(|path| manifest(path))
        .collect::<anyhow::Result<_>>()?;
    manifests.sort_by(|a, b| a.package.name.cmp(&b.package.name));
    ensure!(!manifests.is_empty(), "{}: no crates", folder.display());
    Ok(graph(&manifests))
}

fn manifest(path: &Path) -> anyhow::Result<Manifest> {
    let context = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(context)?;
    toml::from_str(&text).with_context(context)
}

fn graph(manifests: &[Manifest]) -> CrateGraph {
    let index = |name: &str| manifests.iter().position(|m| m.package.name == name);
    let mut uses = BTreeSet::new();
    for (from, manifest) in manifests.iter().enumerate() {
        let only_tests = ["hwall-examples", "hwall-tests"].contains(&&*manifest.package.name);
        let development = manifest.dev_dependencies.iter().filter(|_| only_tests);
        for (name, dependency) in manifest.dependencies.iter().chain(development) {
            if name == TEST_KIT {
                continue;
            }
            if let Some(to) = index(name) {
                let optional = dependency.is_optional();
                uses.insert(Use { from, to, optional });
            }
        }
    }
    CrateGraph {
        nodes: manifests.iter().map(node).collect(),
        uses: uses.into_iter().collect(),
    }
}

fn node(manifest: &Manifest) -> CrateNode {
    let package = &manifest.package;
    let name = package.name.as_str();
    let short = name
        .strip_prefix(PRODUCT)
        .and_then(|rest| rest.strip_prefix('-'));
    // What stands behind a colon is detail.
    let about = package.description.split(": ").next().unwrap_or_default();
    CrateNode {
        name: short.unwrap_or(name).to_owned(),
        about: about.to_owned(),
        kind: match name {
            PRODUCT => CrateKind::Product,
            TEST_KIT => CrateKind::TestKit,
            _ if package.publish == Some(false) => CrateKind::Unpublished,
            _ => CrateKind::Published,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crates_of_this_project_are_read() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let graph = read(&root).unwrap();
        let index = |name: &str| graph.nodes.iter().position(|n| n.name == name).unwrap();
        let used = |from: &str, to: &str| {
            let (from, to) = (index(from), index(to));
            let arrow = graph.uses.iter().find(|u| (u.from, u.to) == (from, to));
            arrow.map(|arrow| arrow.optional)
        };
        assert_eq!(graph.nodes[index("hwall")].kind, CrateKind::Product);
        assert_eq!(graph.nodes[index("lab")].kind, CrateKind::Unpublished);
        assert_eq!(graph.nodes[index("motion")].kind, CrateKind::Published);
        assert_eq!(used("geometry", "numeric"), Some(false));
        assert_eq!(used("hwall", "sim"), Some(true));
        assert_eq!(used("numeric", "geometry"), None);
        assert!(graph.uses.iter().all(|u| u.to != index("testkit")));
    }

    #[test]
    fn an_arrow_stays_unless_a_longer_way_says_the_same() {
        let node = |name: &str| CrateNode {
            name: name.to_owned(),
            about: String::new(),
            kind: CrateKind::Published,
        };
        let arrow = |from, to, optional| Use { from, to, optional };
        let mut graph = CrateGraph {
            nodes: ["a", "b", "c", "d"].map(node).to_vec(),
            uses: vec![
                arrow(0, 1, false),
                arrow(0, 2, false),
                arrow(1, 2, false),
                arrow(1, 3, true),
                arrow(0, 3, false),
                arrow(2, 3, true),
            ],
        };
        let kept = graph.reduced().uses;
        // 1 -> 3 is optional and may go by 2; 0 -> 3 is not.
        let expected = [(0, 1), (1, 2), (0, 3), (2, 3)];
        assert_eq!(
            kept.iter().map(|u| (u.from, u.to)).collect::<Vec<_>>(),
            expected
        );
        assert_eq!(graph.layers(), Some(vec![3, 2, 1, 0]));
        graph.uses.push(arrow(3, 0, false));
        assert_eq!(graph.layers(), None);
    }
}
