//! Material libraries of an OBJ: the colours of materials by name.

use super::text::{LoadLimits, read_text};
use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

/// The libraries named by an OBJ, each read once.
///
/// An OBJ may be untrusted, so a library must be a regular file in the folder of the OBJ or below it: paths that
/// lead elsewhere, and anything that is not a file (a pipe would block), count as missing.
#[derive(Default)]
pub(super) struct Libraries<'a> {
    directory: Option<&'a Path>,
    asked_for: HashSet<String>,
    /// Diffuse colour of each material, if it has one; the first definition counts.
    pub(super) colors: HashMap<String, Option<[f64; 3]>>,
    /// Libraries that are missing or malformed.
    pub(super) missing: Vec<String>,
}

impl<'a> Libraries<'a> {
    pub(super) fn new(directory: Option<&'a Path>) -> Self {
        Self {
            directory,
            ..Self::default()
        }
    }

    /// Reads the libraries named by one statement: the library whose name is the whole text if there is one, otherwise one for each name
    /// that ends in `.mtl` or at the end of the text.
    pub(super) fn read_all(&mut self, names: &str, limits: &LoadLimits) {
        if self.path(names).is_some() {
            return self.read(names, limits);
        }
        let lower = names.to_ascii_lowercase();
        let mut begin = 0;
        for (at, ending) in lower.match_indices(".mtl") {
            let end = at + ending.len();
            if lower[end..].starts_with(char::is_whitespace) {
                self.read(names[begin..end].trim(), limits);
                begin = end;
            }
        }
        self.read(names[begin..].trim(), limits);
    }

    /// Reads a library unless already read.
    fn read(&mut self, name: &str, limits: &LoadLimits) {
        if !self.asked_for.insert(name.to_owned()) {
            return;
        }
        match self.materials(name, limits) {
            Some(materials) => {
                for material in materials {
                    self.colors.entry(material.name).or_insert(material.diffuse);
                }
            }
            None => self.missing.push(name.to_owned()),
        }
    }

    /// The path of a library, if it may be read.
    fn path(&self, name: &str) -> Option<PathBuf> {
        let name = Path::new(name);
        let below = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
        if !name.components().all(below) {
            return None;
        }
        let path = self.directory?.join(name);
        path.metadata().ok()?.is_file().then_some(path)
    }

    fn materials(&self, name: &str, limits: &LoadLimits) -> Option<Vec<tobj::Material>> {
        let text = read_text(&self.path(name)?, limits).ok()?;
        text.lines().all(has_whole_color).then_some(())?;
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).ok()?;
        Some(materials)
    }
}

/// False for a colour with fewer than three numbers, on which `tobj` would panic.
fn has_whole_color(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let color = matches!(words.next(), Some("Ka" | "Kd" | "Ks" | "Ke"));
    let numbers = words.filter(|w| w.parse().is_ok_and(f64::is_finite));
    !color || numbers.take(3).count() == 3
}
