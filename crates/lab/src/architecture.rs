//! The diagram of the crates and their dependencies, drawn from their manifests.

use crate::report::template;
use anyhow::{Context, ensure};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The package that composes the others; the names of the others begin with it and a dash.
const PRODUCT: &str = "hwall";
/// Used by tests and reports everywhere; neither it nor its arrows are drawn.
const TEST_KIT: &str = "hwall-testkit";
/// Packages of tests and command lines outside `crates/`: their dev-dependencies count as dependencies.
const BESIDE: [&str; 2] = ["examples", "tests"];

/// A crate of the workspace.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crate {
    /// Its name without the prefix of the workspace.
    pub name: String,
    /// Short description.
    pub about: String,
    /// `product`, `published` or `unpublished`: its class in the drawing.
    pub class: &'static str,
}

/// A dependency; both ends are indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// The dependent crate.
    pub from: usize,
    /// The dependency.
    pub to: usize,
    /// Only behind a feature.
    pub optional: bool,
}

/// All crates and their dependencies.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CrateGraph {
    /// The crates, by name.
    pub crates: Vec<Crate>,
    /// In order.
    pub uses: Vec<Use>,
}

#[derive(Deserialize)]
struct Manifest {
    package: Package,
    #[serde(default)]
    dependencies: BTreeMap<String, toml::Value>,
    #[serde(default, rename = "dev-dependencies")]
    dev_dependencies: BTreeMap<String, toml::Value>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    #[serde(default)]
    description: String,
    publish: Option<bool>,
}

/// Reads `crates/*`, `examples` and `tests` below the root of the project.
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
    paths.extend(BESIDE.map(|name| root.join(name).join("Cargo.toml")));
    let mut manifests = Vec::new();
    for path in paths {
        let context = || path.display().to_string();
        let text = std::fs::read_to_string(&path).with_context(context)?;
        let manifest: Manifest = toml::from_str(&text).with_context(context)?;
        manifests.push(manifest);
    }
    manifests.retain(|manifest| manifest.package.name != TEST_KIT);
    manifests.sort_by(|a, b| a.package.name.cmp(&b.package.name));
    ensure!(!manifests.is_empty(), "{}: no crates", folder.display());
    Ok(CrateGraph::of(&manifests))
}

impl CrateGraph {
    fn of(manifests: &[Manifest]) -> Self {
        let crates: Vec<Crate> = manifests.iter().map(|m| Crate::of(&m.package)).collect();
        let mut uses = Vec::new();
        for (from, manifest) in manifests.iter().enumerate() {
            let used = match BESIDE.contains(&crates[from].name.as_str()) {
                true => &manifest.dev_dependencies,
                false => &manifest.dependencies,
            };
            for (to, other) in manifests.iter().enumerate() {
                if let Some(dependency) = used.get(&other.package.name) {
                    let optional = dependency.get("optional").and_then(toml::Value::as_bool);
                    let optional = optional.unwrap_or(false);
                    uses.push(Use { from, to, optional });
                }
            }
        }
        Self { crates, uses }
    }

    /// The arrows without those that a longer path implies. A path with optional arrows implies only optional arrows.
    pub fn needed(&self) -> impl Iterator<Item = Use> {
        let says_more = |arrow: &&Use| {
            let (mut seen, mut open) = (vec![false; self.crates.len()], vec![arrow.from]);
            while let Some(node) = open.pop() {
                let onward = |other: &&Use| {
                    other.from == node && other != arrow && (arrow.optional || !other.optional)
                };
                for other in self.uses.iter().filter(onward) {
                    if !std::mem::replace(&mut seen[other.to], true) {
                        open.push(other.to);
                    }
                }
            }
            !seen[arrow.to]
        };
        self.uses.iter().filter(says_more).copied()
    }

    /// The layer of each crate, from 0 for those that use nothing: one above its highest dependency. `None` for a cycle.
    pub fn layers(&self) -> Option<Vec<usize>> {
        let mut layers = vec![0; self.crates.len()];
        for _ in 0..=layers.len() {
            let mut settled = true;
            for arrow in &self.uses {
                let least = layers[arrow.to] + 1;
                settled &= layers[arrow.from] >= least;
                layers[arrow.from] = layers[arrow.from].max(least);
            }
            if settled {
                return Some(layers);
            }
        }
        None
    }
}

impl Crate {
    fn of(package: &Package) -> Self {
        let rest = package.name.strip_prefix(PRODUCT);
        let short = rest.and_then(|rest| rest.strip_prefix('-'));
        // Keep only the part before a colon.
        let about = package.description.split(": ").next().unwrap_or_default();
        Self {
            name: short.unwrap_or(&package.name).to_owned(),
            about: about.to_owned(),
            class: match package.publish {
                _ if package.name == PRODUCT => "product",
                Some(false) => "unpublished",
                _ => "published",
            },
        }
    }
}

/// Width of a box, and horizontal step between boxes.
const WIDTH_PX: f64 = 184.0;
const STEP_PX: f64 = 216.0;
/// Characters per line of text in a box, and line height.
const LETTERS: usize = 26;
const LINE_PX: f64 = 15.0;
/// Gap between layers, for the arrows.
const RISE_PX: f64 = 58.0;
const MARGIN_PX: f64 = 24.0;
const LEGEND_PX: f64 = 64.0;
/// Least width, for the legend.
const LEAST_WIDTH_PX: f64 = 900.0;

/// The box of a crate.
#[derive(Clone, Default)]
struct Place {
    lines: Vec<String>,
    middle_px: f64,
    top_px: f64,
}

/// Draws the crates; arrows implied by a longer path are left out.
///
/// # Errors
/// Cyclic dependencies.
pub fn svg(graph: &CrateGraph) -> anyhow::Result<String> {
    let layers = layers(graph).context("crates use each other in a circle")?;
    let most = layers.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let width_px = (2.0 * MARGIN_PX + WIDTH_PX + (most - 1.0) * STEP_PX).max(LEAST_WIDTH_PX);
    let mut places = vec![Place::default(); graph.crates.len()];
    let mut top_px = MARGIN_PX;
    for layer in layers.iter().rev() {
        let first_px = 0.5 * (width_px - (layer.len() as f64 - 1.0) * STEP_PX);
        let mut highest_px: f64 = 0.0;
        for (column, &node) in layer.iter().enumerate() {
            let lines = lines(&graph.crates[node].about);
            let middle_px = first_px + column as f64 * STEP_PX;
            places[node] = Place {
                lines,
                middle_px,
                top_px,
            };
            highest_px = highest_px.max(places[node].height_px());
        }
        top_px += highest_px + RISE_PX;
    }
    let (mut arrows, mut boxes) = (String::new(), String::new());
    for one in graph.needed() {
        let (from, to) = (&places[one.from], &places[one.to]);
        let class = if one.optional { " option" } else { "" };
        writeln!(
            arrows,
            "  <path class=\"arrow{class}\" d=\"M{} {} L{} {}\"/>",
            from.middle_px,
            from.top_px + from.height_px(),
            to.middle_px,
            to.top_px - 1.0
        )?;
    }
    for (node, place) in graph.crates.iter().zip(&places) {
        place.draw(node, &mut boxes)?;
    }
    let (height_px, legend_px) = (top_px - RISE_PX + LEGEND_PX, top_px - RISE_PX + 10.0);
    template(include_str!("architecture/frame.svg")).fill(&[
        ("width", &width_px),
        ("height", &height_px),
        ("legend", &legend_px),
        ("arrows", &arrows),
        ("boxes", &boxes),
    ])
}

/// The crates of each layer, from the lowest up, each above the middle of its dependencies.
fn layers(graph: &CrateGraph) -> Option<Vec<Vec<usize>>> {
    let depths = graph.layers()?;
    let count = depths.iter().max().map_or(0, |most| most + 1);
    let mut layers: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut share = vec![0.0; depths.len()];
    for (depth, layer) in layers.iter_mut().enumerate() {
        let mut keyed: Vec<(f64, usize)> = Vec::new();
        for node in (0..depths.len()).filter(|&node| depths[node] == depth) {
            let used = graph.needed().filter(|u| u.from == node);
            let used: Vec<f64> = used.map(|u| share[u.to]).collect();
            let mean = used.iter().sum::<f64>() / used.len().max(1) as f64;
            keyed.push((mean, node));
        }
        keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
        layer.extend(keyed.iter().map(|(_, node)| *node));
        for (place, &node) in layer.iter().enumerate() {
            share[node] = (place as f64 + 0.5) / layer.len() as f64;
        }
    }
    Some(layers)
}

fn lines(about: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in about.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= LETTERS => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

impl Place {
    fn height_px(&self) -> f64 {
        32.0 + LINE_PX * self.lines.len() as f64
    }

    fn draw(&self, node: &Crate, out: &mut String) -> std::fmt::Result {
        let (middle_px, top_px) = (self.middle_px, self.top_px);
        writeln!(
            out,
            "  <rect class=\"{}\" x=\"{}\" y=\"{top_px}\" width=\"{WIDTH_PX}\" height=\"{}\" rx=\"6\"/>",
            node.class,
            middle_px - 0.5 * WIDTH_PX,
            self.height_px()
        )?;
        let mut text = |class: &str, down_px: f64, text: &str| {
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            let y_px = top_px + down_px;
            writeln!(
                out,
                "  <text class=\"{class}\" x=\"{middle_px}\" y=\"{y_px}\">{text}</text>"
            )
        };
        text("name", 20.0, &node.name)?;
        for (line, down) in self.lines.iter().zip(1..) {
            text("what", 22.0 + LINE_PX * f64::from(down), line)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    #[test]
    fn the_crates_of_this_project_are_read() {
        let graph = read(&root()).unwrap();
        let index = |name: &str| graph.crates.iter().position(|c| c.name == name);
        let used = |from: &str, to: &str| {
            let (from, to) = (index(from).unwrap(), index(to).unwrap());
            let arrow = graph.uses.iter().find(|u| (u.from, u.to) == (from, to));
            arrow.map(|arrow| arrow.optional)
        };
        for (name, class) in [
            ("hwall", "product"),
            ("lab", "unpublished"),
            ("motion", "published"),
        ] {
            assert_eq!(graph.crates[index(name).unwrap()].class, class);
        }
        assert_eq!(used("geometry", "numeric"), Some(false));
        assert_eq!(used("hwall", "sim"), Some(true));
        assert_eq!(used("numeric", "geometry"), None);
        assert_eq!(used("examples", "stage"), Some(false));
        assert_eq!(index("testkit"), None);
    }

    #[test]
    fn an_arrow_stays_unless_a_longer_way_says_the_same() {
        let node = |name: &str| Crate {
            name: name.to_owned(),
            about: String::new(),
            class: "published",
        };
        let arrow = |(from, to, optional)| Use { from, to, optional };
        let firm = [(0, 1), (0, 2), (1, 2), (0, 3)].map(|(from, to)| (from, to, false));
        let optional = [(1, 3, true), (2, 3, true)];
        let mut graph = CrateGraph {
            crates: ["a", "b", "c", "d"].map(node).to_vec(),
            uses: firm.into_iter().chain(optional).map(arrow).collect(),
        };
        let kept: Vec<_> = graph.needed().map(|u| (u.from, u.to)).collect();
        // 1 -> 3 is optional and implied through 2; 0 -> 3 is not.
        assert_eq!(kept, [(0, 1), (1, 2), (0, 3), (2, 3)]);
        assert_eq!(graph.layers(), Some(vec![3, 2, 1, 0]));
        graph.uses.push(arrow((3, 0, false)));
        assert_eq!(graph.layers(), None);
    }

    #[test]
    fn the_tracked_picture_shows_the_crates_as_they_are() {
        let tracked = root().join("docs/figures/architecture/house.svg");
        let tracked = std::fs::read_to_string(tracked).unwrap();
        let remedy = "cargo run --release --example architecture -- --docs";
        let is_drawn = tracked == svg(&read(&root()).unwrap()).unwrap();
        assert!(is_drawn, "house.svg is out of date: {remedy}");
    }

    #[test]
    fn every_arrow_points_down() {
        let graph = read(&root()).unwrap();
        let layers = layers(&graph).unwrap();
        let layer = |node| layers.iter().position(|l| l.contains(&node)).unwrap();
        assert!(graph.uses.iter().all(|u| layer(u.from) > layer(u.to)));
        assert_eq!(layers.concat().len(), graph.crates.len());
    }
}
