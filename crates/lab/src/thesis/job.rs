//! Input of the chapters.

use crate::documents::Documents;
use std::path::{Path, PathBuf};

/// Input of a chapter's function.
pub(super) struct Job<'a> {
    /// Seed of simulated people and sensors.
    pub seed: u64,
    /// Folder with the maps published with the 2018 paper; `None`: [`FOLDER`](crate::reach::published::FOLDER), if it exists.
    pub published: Option<&'a Path>,
    /// Destination of the figures.
    pub documents: &'a Documents,
}

impl Job<'_> {
    /// The path of a figure, and the line that shows it in the document.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub(super) fn figure(&self, name: &str, caption: &str) -> anyhow::Result<(PathBuf, String)> {
        let path = self.documents.figures("thesis")?.join(name);
        Ok((path, format!("![{caption}](figures/thesis/{name})")))
    }
}
