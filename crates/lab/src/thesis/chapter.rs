//! The chapters, and the input of their functions.

use crate::documents::Documents;
use hwall_stage::named;
use std::path::{Path, PathBuf};

named! {
    /// A chapter with figures, tables or experiments that a program can redo.
    pub enum Chapter {
        /// The system, prediction by gaze, redirection.
        System = "III",
        /// Reachability maps, and the experiments with a whiteboard and with questions.
        Maps = "IV",
        /// Roughness.
        Roughness = "V",
        /// Learned response.
        Prediction = "VI",
        /// Open points.
        Outlook = "VII",
    }
}

impl Chapter {
    /// The chapter of a number, Roman or Arabic.
    ///
    /// # Errors
    /// Any other text.
    pub fn numbered(text: &str) -> Result<Self, String> {
        let of = |(number, chapter): &(usize, Self)| {
            text.eq_ignore_ascii_case(chapter.name()) || text == number.to_string()
        };
        let found = (3..).zip(Self::ALL).find(of);
        found.map(|(_, chapter)| chapter).ok_or_else(|| {
            "chapters that a program can redo are III, IV, V, VI and VII, or 3 to 7".to_owned()
        })
    }
}

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
