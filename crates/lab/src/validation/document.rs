//! The whole of docs/VALIDATION.md.

use crate::documents::Documents;
use crate::reach::figures;
use crate::reach::published;
use crate::report::page;
use crate::validation::{bip, perception, reachability, texture};
use anyhow::ensure;
use std::path::{Path, PathBuf};

/// The name of the document.
pub const NAME: &str = "VALIDATION.md";

/// Locations of the references, and settings.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// Folder with `ori_1.txt` to `ori_7.txt`, the maps published with the 2018 paper.
    pub published: &'a Path,
    /// Folder with the reference runs of Bayesian Interaction Primitives and their workload.
    pub bip: &'a Path,
    /// Folder with reference numbers of textures.
    pub texton: &'a Path,
    /// Folder with reference studies and their analyses.
    pub psychophysics: &'a Path,
    /// Seed of the random poses and touches.
    pub seed: u64,
    /// Random poses.
    pub poses: usize,
}

impl Request<'_> {
    /// Checks, before minutes of work, for missing references and reports all of them at once.
    ///
    /// # Errors
    /// A folder that is missing.
    pub fn check(&self) -> anyhow::Result<()> {
        let folders = [
            ("--published", self.published),
            ("--bip", self.bip),
            ("--texton", self.texton),
            ("--psychophysics", self.psychophysics),
        ];
        let missing = folders.iter().filter(|(_, folder)| !folder.is_dir());
        let missing: Vec<String> = missing
            .map(|(flag, folder)| format!("{flag} {}", folder.display()))
            .collect();
        ensure!(
            missing.is_empty(),
            "nothing was compared: the references are not part of the project, and these folders of theirs are not there: {}",
            missing.join(", ")
        );
        Ok(())
    }
}

/// A document that was written.
#[derive(Debug, Clone)]
pub struct Written {
    /// Its path.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

/// Compares everything, and writes the document with its figures.
///
/// # Errors
/// A reference that is missing or malformed, a file that cannot be written.
pub fn write(request: &Request<'_>, documents: &Documents) -> anyhow::Result<Written> {
    request.check()?;
    let published = published::read(request.published)?;
    let found = reachability::reachability(&published, request.seed, request.poses)?;
    let text = page(
        include_str!("document.md"),
        request.seed,
        &[
            ("reachability", &found.text),
            ("bip", &bip::section(request.bip)?),
            ("textures", &texture::section(request.texton, request.seed)?),
            ("perception", &perception::section(request.psychophysics)?),
        ],
    )?;
    let folder = documents.figures("reachability")?;
    figures::comparison(&folder.join("comparison.svg"), &found.comparisons)?;
    let path = documents.write(NAME, &text)?;
    Ok(Written { path, text })
}
