//! What `.ci/deny.toml` asks of the dependencies holds, also where `cargo deny` is not installed: no network, no other tool.

use crate::common::files::{root, text};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The workspace, and the Python package, which is one of its own.
fn workspaces() -> [PathBuf; 2] {
    [root(), root().join("crates/python")]
}

fn settings() -> toml::Table {
    text(".ci/deny.toml").parse().unwrap()
}

/// Strings of a list.
fn list<'a>(settings: &'a toml::Table, section: &str, key: &str) -> BTreeSet<&'a str> {
    let values = settings[section][key].as_array().unwrap();
    values.iter().map(|value| value.as_str().unwrap()).collect()
}

/// Does a licence expression (SPDX, or the older `A/B`) hold with these licences alone?
fn is_allowed(expression: &str, allowed: &BTreeSet<&str>) -> bool {
    let spaced = expression
        .replace('/', " OR ")
        .replace('(', " ( ")
        .replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let held = any(&words, &mut at, allowed);
    assert_eq!(at, words.len(), "{expression}");
    held
}

fn any(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> bool {
    let mut held = all(words, at, allowed);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        held |= all(words, at, allowed);
    }
    held
}

fn all(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> bool {
    let mut held = one(words, at, allowed);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        held &= one(words, at, allowed);
    }
    held
}

fn one(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> bool {
    let word = words[*at];
    *at += 1;
    if word == "(" {
        let held = any(words, at, allowed);
        assert_eq!(words[*at], ")");
        *at += 1;
        return held;
    }
    if words.get(*at) == Some(&"WITH") {
        let name = format!("{word} WITH {}", words[*at + 1]);
        *at += 2;
        return allowed.contains(name.as_str());
    }
    allowed.contains(word)
}

#[test]
fn licence_expressions_are_read() {
    let allowed = BTreeSet::from(["MIT", "Unicode-3.0", "Apache-2.0 WITH LLVM-exception"]);
    for (expression, held) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("Unlicense/MIT", true),
        ("MIT AND GPL-3.0", false),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
        ("GPL-3.0 OR (MIT AND Zlib)", false),
        ("Apache-2.0 WITH LLVM-exception OR GPL-3.0", true),
        ("Apache-2.0", false),
    ] {
        assert_eq!(is_allowed(expression, &allowed), held, "{expression}");
    }
}

/// Packages of a whole workspace with all features, as this machine would build them.
fn packages(workspace: &Path) -> Option<Vec<Value>> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("-vV").output().ok()?.stdout;
    let version = String::from_utf8(version).ok()?;
    let host = version.lines().find_map(|l| l.strip_prefix("host: "))?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--offline", "--locked", "--all-features"])
        .args(["--format-version", "1", "--filter-platform", host])
        .current_dir(workspace)
        .output()
        .ok()?;
    let metadata: Value = serde_json::from_slice(&output.stdout).ok()?;
    metadata["packages"].as_array().cloned()
}

#[test]
fn licences_are_those_that_are_allowed() {
    let settings = settings();
    let known = ["bans", "graph", "licenses", "sources"];
    let sections: Vec<&str> = settings.keys().map(String::as_str).collect();
    assert_eq!(BTreeSet::from_iter(sections), BTreeSet::from(known));
    let allowed = list(&settings, "licenses", "allow");
    for workspace in workspaces() {
        let Some(packages) = packages(&workspace) else {
            let name = workspace.display();
            println!("skipped: cargo cannot list the packages of {name} without a network");
            continue;
        };
        assert!(packages.len() > 100, "{}", packages.len());
        let mut refused = BTreeMap::new();
        for package in &packages {
            let name = package["name"].as_str().unwrap();
            let licence = package["license"].as_str().unwrap_or("none");
            if !is_allowed(licence, &allowed) {
                refused.insert(name, licence);
            }
        }
        assert!(refused.is_empty(), "{refused:?}");
    }
}

/// Also what only other machines would build, and what no build uses.
#[test]
fn locked_packages_are_not_banned_and_come_from_one_registry_or_are_our_own() {
    let settings = settings();
    let banned = settings["bans"]["deny"].as_array().unwrap();
    let is_banned = |name: &str| banned.iter().any(|ban| ban["crate"].as_str() == Some(name));
    assert!(is_banned("nalgebra"));
    for key in ["unknown-registry", "unknown-git"] {
        assert_eq!(settings["sources"][key].as_str(), Some("deny"));
    }
    for workspace in workspaces() {
        let lock: toml::Table = text(workspace.join("Cargo.lock")).parse().unwrap();
        let packages = lock["package"].as_array().unwrap();
        let sources = packages.iter().filter_map(|p| p.get("source"));
        let sources: BTreeSet<&str> = sources.map(|s| s.as_str().unwrap()).collect();
        assert_eq!(sources.len(), 1, "{sources:?}");
        assert!(sources.iter().all(|s| s.starts_with("registry+")));
        for package in packages {
            let name = package["name"].as_str().unwrap();
            assert!(!is_banned(name), "{name}");
            let is_own = package.get("source").is_none();
            assert_eq!(is_own, name.starts_with("hwall"), "{name}");
        }
    }
}
