//! The document of the contact study: all protocols in one file.

use crate::contact::candidates::Candidate;
use crate::contact::dissertation::{self, Overrides};
use crate::contact::report;
use crate::rooms::study;
use anyhow::{Context, ensure};
use hwall_testkit::Machine;
use std::path::Path;

/// The name of the document.
pub const NAME: &str = "CONTACT-STUDY.md";

/// Writes the document, with the recordings if there are any. Figures, scores and predictions go to `out`.
///
/// # Errors
/// A protocol that fails, a file that cannot be written.
pub fn write(
    file: &Path,
    overrides: Overrides,
    candidates: &[Candidate],
    recordings: Option<&Path>,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    // Said before minutes of work, not after them.
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
    ensure!(
        folder.is_none_or(Path::is_dir) && !file.is_dir(),
        "{}: no file can be written there",
        file.display()
    );
    let mut text = format!(
        "# Where, when and which surface: the study\n\n\
         Written by `contact_study --report`. {}. Simulated people are drawn from the seed; those \
         judged are never those learnt from, and each section says who is who.\n\n",
        Machine::detect(overrides.seed)
    );
    text += &dissertation::report(overrides, candidates, out)?;
    text += "\n";
    text += &study::report(overrides.seed, out)?;
    if let Some(dir) = recordings {
        text += "\n";
        text += &report::recordings(dir, candidates, out)?;
    }
    hwall_files::write(file, text).with_context(|| file.display().to_string())
}
