//! What a registry and the pages that it leads to need of every crate that is published.

use crate::common::files::{entries, root, text};
use std::path::PathBuf;

/// Folders of the published crates, with their manifests.
fn published() -> Vec<(PathBuf, String)> {
    let folders = entries(&root().join("crates")).into_iter();
    let all = folders.map(|folder| {
        let manifest = text(folder.join("Cargo.toml"));
        (folder, manifest)
    });
    all.filter(|(_, manifest)| !manifest.contains("publish = false"))
        .collect()
}

/// Targets of the links of a page.
fn links(page: &str) -> impl Iterator<Item = &str> {
    let after = page.split("](").skip(1);
    after.filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
}

/// The part of a manifest below a heading.
fn part<'a>(manifest: &'a str, heading: &str) -> &'a str {
    let rest = manifest.split_once(heading).map_or("", |(_, rest)| rest);
    rest.split("\n[").next().unwrap_or_default()
}

#[test]
fn published_crates_have_what_a_registry_and_its_pages_need() {
    let (licence, crates) = (text("LICENSE"), published());
    assert!(crates.len() > 20, "{}", crates.len());
    for (folder, manifest) in crates {
        let name = folder.display();
        assert_eq!(text(folder.join("LICENSE")), licence, "{name}");
        assert!(folder.join("CHANGELOG.md").is_file(), "{name}: no changes");
        for field in "description keywords readme rust-version license".split(' ') {
            let has = manifest.contains(&format!("\n{field}"));
            assert!(has, "{name}: no {field}");
        }
        // Features are built and labelled on the pages of the documentation.
        if manifest.contains("\n[features]") {
            let docs = part(&manifest, "[package.metadata.docs.rs]");
            assert!(docs.contains("all-features = true"), "{name}");
            let lib = text(folder.join("src/lib.rs"));
            assert!(lib.contains("feature(doc_cfg)"), "{name}: no labels");
        }
        // The test kit is not published, and what needs it is left out of the package.
        if part(&manifest, "[dev-dependencies]").contains("hwall-testkit") {
            for left_out in ["tests", "benches"] {
                let has = folder.join(left_out).is_dir();
                let says = part(&manifest, "[package]").contains(&format!("\"{left_out}\""));
                assert!(!has || says, "{name}: {left_out} are in the package");
            }
        }
        // A page elsewhere has no folders beside it.
        for link in links(&text(folder.join("README.md"))) {
            let outside = link.starts_with("..") || link.starts_with('/');
            assert!(!outside, "{name}: README links to {link}");
            let file = link.split('#').next().unwrap_or_default();
            let is_web = link.contains("://") || file.is_empty();
            assert!(is_web || folder.join(file).exists(), "{name}: {link}");
        }
        let examples = entries(&folder.join("examples"));
        assert!(!examples.is_empty(), "{name}: no example");
    }
}
