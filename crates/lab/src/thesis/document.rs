//! The whole of docs/THESIS.md, and the same as a page.

use super::job::Job;
use super::{html, maps, outlook, prediction, roughness, system};
use crate::documents::Documents;
use crate::reach::published;
use crate::report::page;
use anyhow::{Context, ensure};
use hwall_stage::named;
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "THESIS.md";
/// The name of the page.
pub const PAGE: &str = "thesis.html";

/// Settings.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Only this chapter: III, IV, V, VI or VII, or 3 to 7
    #[arg(long, value_name = "N", value_parser = Chapter::numbered, allow_negative_numbers = true)]
    pub chapter: Option<Chapter>,
    /// Seed of simulated people and sensors
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Where this folder is missing, the page says what was skipped.
    #[arg(long, value_name = "DIR", help = format!("Folder with ori_1.txt .. ori_7.txt, the maps published with the 2018 paper [default: {}, if it is there]", published::FOLDER))]
    pub published: Option<PathBuf>,
}

/// Redoes the chapters and writes the document with its figures; also writes a page without outside resources, unless the documents are the
/// tracked ones. Returns the path of the page, or of the document.
///
/// # Errors
/// A single chapter that would overwrite the tracked document; a folder of published maps that is named and missing; a study that fails, a
/// file that cannot be written.
pub fn write(
    request: &Request,
    documents: &Documents,
    mut progress: impl FnMut(Chapter),
) -> anyhow::Result<PathBuf> {
    let is_tracked = documents.readme().is_some();
    ensure!(
        request.chapter.is_none() || !is_tracked,
        "--chapter: the tracked document has all chapters; leave --docs out"
    );
    // Checked before the work.
    if let Some(folder) = &request.published {
        let (is, name) = (folder.is_dir(), folder.display());
        ensure!(
            is,
            "--published {name}: no such folder; leave it out to skip what needs it"
        );
    }
    let job = Job {
        seed: request.seed,
        published: request.published.as_deref(),
        documents,
    };
    let mut chapters = String::new();
    for chapter in Chapter::ALL {
        if request.chapter.is_none_or(|only| only == chapter) {
            progress(chapter);
            let section = match chapter {
                Chapter::System => system::section(&job),
                Chapter::Maps => maps::section(&job),
                Chapter::Roughness => roughness::section(&job),
                Chapter::Prediction => prediction::section(&job),
                Chapter::Outlook => outlook::section(&job),
            };
            chapters += &section.with_context(|| format!("chapter {}", chapter.name()))?;
            chapters += "\n";
        }
    }
    let template = include_str!("document.md");
    let text = page(template, request.seed).fill(&[("chapters", &chapters.trim_end())])?;
    let path = documents.write(NAME, &text)?;
    match is_tracked {
        true => Ok(path),
        false => documents.write(PAGE, &html::page(&text, documents.folder())?),
    }
}

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
