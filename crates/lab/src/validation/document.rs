//! The whole of docs/VALIDATION.md.

use crate::documents::Documents;
use crate::reach::figures;
use crate::reach::published;
use crate::report::page;
use crate::validation::{bip, perception, reachability, texture};
use anyhow::ensure;
use hwall_stage::numbers::count_within;
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "VALIDATION.md";

/// Locations of the references, and settings.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Folder with ori_1.txt .. ori_7.txt, the maps published with the 2018 paper
    #[arg(long, default_value = published::FOLDER)]
    pub published: PathBuf,
    /// Folder with the reference runs of Bayesian Interaction Primitives and their workload
    #[arg(long, default_value = "../shared/reference/bip")]
    pub bip: PathBuf,
    /// Folder with reference numbers of textures
    #[arg(long, default_value = "../shared/reference/texton")]
    pub texton: PathBuf,
    /// Folder with reference studies and their analyses
    #[arg(long, default_value = "../shared/reference/psychophysics")]
    pub psychophysics: PathBuf,
    /// Seed of the random poses
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Random poses
    #[arg(long, default_value_t = 10_000_000, value_parser = count_within::<1, 1_000_000_000>, allow_negative_numbers = true)]
    pub poses: usize,
}

impl Request {
    /// Checks, before minutes of work, for missing references and reports all of them at once.
    ///
    /// # Errors
    /// A folder that is missing.
    pub fn check(&self) -> anyhow::Result<()> {
        let folders = [
            ("--published", &self.published),
            ("--bip", &self.bip),
            ("--texton", &self.texton),
            ("--psychophysics", &self.psychophysics),
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

/// Compares everything, and writes the document with its figures; returns its text and its path.
///
/// # Errors
/// A reference that is missing or malformed, a file that cannot be written.
pub fn write(request: &Request, documents: &Documents) -> anyhow::Result<(String, PathBuf)> {
    request.check()?;
    let published = published::read(&request.published)?;
    let (section, comparisons) = reachability::section(&published, request.seed, request.poses)?;
    let text = page(include_str!("document.md"), request.seed).fill(&[
        ("reachability", &section),
        ("bip", &bip::section(&request.bip)?),
        (
            "textures",
            &texture::section(&request.texton, request.seed)?,
        ),
        ("perception", &perception::section(&request.psychophysics)?),
    ])?;
    let folder = documents.figures("reachability")?;
    figures::comparison(&folder.join("comparison.svg"), &comparisons)?;
    let path = documents.write(NAME, &text)?;
    Ok((text, path))
}
