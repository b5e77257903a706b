//! The size and the order of the code: lines by crate, long files, full folders, files that use each other in a circle.
//!
//! `cargo test -p hwall-tests --test it house -- --nocapture` prints the figures.

use crate::common::files::{entries, files_below, root};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Lines of code of a file: no blanks, no comments.
const LONGEST_FILE: usize = 500;
/// Files of a folder; 12 are wanted.
const FULLEST_FOLDER: usize = 16;

fn crates() -> Vec<PathBuf> {
    entries(&root().join("crates"))
}

/// Code before the tests of a file, without comments.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("a source file");
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The files of a crate's `src` that are no tests.
fn sources(src: &Path) -> Vec<PathBuf> {
    let mut files = files_below(src, "rs");
    files.retain(|path| {
        let mut below = path.strip_prefix(src).unwrap().iter();
        !path.ends_with("tests.rs") && below.all(|name| name != "tests")
    });
    files
}

#[test]
fn files_are_short_and_folders_not_full() {
    let (mut all, mut long) = (0, Vec::new());
    let mut folders = BTreeMap::<PathBuf, usize>::new();
    for folder in crates() {
        let mut lines_of_crate = 0;
        for path in sources(&folder.join("src")) {
            let lines = code(&path).lines().count();
            lines_of_crate += lines;
            *folders.entry(path.with_file_name("")).or_default() += 1;
            if lines > LONGEST_FILE {
                long.push(format!("{} has {lines} lines", path.display()));
            }
        }
        all += lines_of_crate;
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        println!("{name:16} {lines_of_crate:6} lines of src");
    }
    let count = crates().len();
    println!("{:16} {all:6} lines of src in {count} crates", "all");
    folders.retain(|_, files| *files > FULLEST_FOLDER);
    assert!(long.is_empty(), "{long:#?}");
    assert!(folders.is_empty(), "{folders:#?}");
}

/// A module, as the names from the root of its crate.
type Module = Vec<String>;

/// The modules of a crate that have files of their own, and what each names with `use` or in full.
struct Modules {
    names: BTreeMap<Module, Vec<Module>>,
    /// What a module hands on with `pub use`, by name.
    handed_on: BTreeMap<(Module, String), Module>,
}

/// The paths of a tree of `use`: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn paths(tree: &str, before: &[String], found: &mut Vec<Vec<String>>) {
    let names = |text: &str| {
        let names = text
            .split("::")
            .map(str::trim)
            .filter(|name| !name.is_empty());
        names.map(str::to_owned).collect::<Vec<_>>()
    };
    let Some((head, rest)) = tree.split_once('{') else {
        let tree = tree.split(" as ").next().unwrap_or_default();
        found.push([before, &names(tree)].concat());
        return;
    };
    let before = [before, &names(head)].concat();
    let inside = rest.rsplit_once('}').map_or(rest, |(inside, _)| inside);
    let (mut depth, mut from) = (0, 0);
    for (at, letter) in inside.char_indices().chain([(inside.len(), ',')]) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = inside[from..at].trim();
                if !part.is_empty() {
                    paths(part, &before, found);
                }
                from = at + 1;
            }
            _ => {}
        }
    }
}

impl Modules {
    fn of(src: &Path) -> Self {
        let mut texts = BTreeMap::new();
        for path in &sources(src) {
            let below = path.strip_prefix(src).unwrap().with_extension("");
            let names = below.iter().map(|name| name.to_string_lossy().into_owned());
            let mut module: Module = names.collect();
            if module
                .last()
                .is_some_and(|name| ["mod", "lib", "main"].contains(&&**name))
            {
                module.pop();
            }
            texts.insert(module, code(path));
        }
        let mut modules = Self {
            names: texts
                .keys()
                .map(|module| (module.clone(), Vec::new()))
                .collect(),
            handed_on: BTreeMap::new(),
        };
        for (module, text) in &texts {
            let (mut uses, mut rest) = (Vec::new(), String::new());
            for statement in text.split_inclusive(';') {
                let Some((public, tree)) = statement.rsplit_once("use ") else {
                    rest.push_str(statement);
                    continue;
                };
                let mut found = Vec::new();
                paths(tree.trim_end_matches(';'), &[], &mut found);
                let is_public = public.trim_end().ends_with([')', 'b']) && public.contains("pub");
                uses.extend(found.into_iter().map(|path| (is_public, path)));
            }
            // A visibility uses nothing.
            let rest = rest.replace("(in crate::", "(");
            for word in rest.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':') {
                if word.starts_with("crate::") || word.starts_with("super::") {
                    let names = word.split("::").map(str::to_owned);
                    uses.push((false, names.filter(|name| !name.is_empty()).collect()));
                }
            }
            for (is_public, path) in uses {
                let Some(path) = modules.absolute(module, path) else {
                    continue;
                };
                match (is_public, path.last()) {
                    (true, Some(name)) => {
                        let key = (module.clone(), name.clone());
                        modules.handed_on.insert(key, path);
                    }
                    _ => modules.names.get_mut(module).unwrap().push(path),
                }
            }
        }
        modules
    }

    /// From the root of the crate; `None`: of another crate.
    fn absolute(&self, module: &Module, path: Vec<String>) -> Option<Vec<String>> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let from = match path.first()?.as_str() {
            "crate" => return Some(path[1..].to_vec()),
            "self" => return Some([module, &path[1..]].concat()),
            "super" => &module[..module.len().checked_sub(ups)?],
            _ if self.names.contains_key(&[module, &path[..1]].concat()) => &module[..],
            _ => return None,
        };
        Some([from, &path[ups..]].concat())
    }

    /// The module that has what a path names.
    fn home(&self, path: &[String], steps: usize) -> Option<Module> {
        let known = (0..=path.len()).rev().map(|to| path[..to].to_vec());
        let module = known
            .into_iter()
            .find(|module| self.names.contains_key(module))?;
        let name = path.get(module.len()).cloned().unwrap_or_default();
        match self.handed_on.get(&(module.clone(), name)) {
            Some(further) if steps > 0 && further != path => self.home(further, steps - 1),
            _ => Some(module),
        }
    }

    /// The modules in circles, or between two circles: what remains after repeatedly removing each module that uses no other one, or that no
    /// other one uses.
    fn circles(&self) -> Vec<Module> {
        let mut uses: BTreeMap<&Module, BTreeSet<Module>> = BTreeMap::new();
        for (module, paths) in &self.names {
            let homes = paths.iter().filter_map(|path| self.home(path, 8));
            uses.insert(module, homes.filter(|home| home != module).collect());
        }
        loop {
            let used: BTreeSet<Module> = uses.values().flatten().cloned().collect();
            let left: BTreeSet<Module> = uses.keys().map(|module| (*module).clone()).collect();
            let before = uses.len();
            uses.retain(|module, homes| {
                homes.retain(|home| left.contains(home));
                !homes.is_empty() && used.contains(*module)
            });
            if uses.len() == before {
                return uses.into_keys().cloned().collect();
            }
        }
    }
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let mut found = Vec::new();
    for folder in crates() {
        for module in Modules::of(&folder.join("src")).circles() {
            found.push(format!("{} {}", folder.display(), module.join("::")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}
