//! The document that the contact study leaves behind: every protocol in one file, figures beside it.

use crate::contact::candidates::Candidate;
use crate::contact::dissertation::{self as contact_dissertation, Choice};
use crate::contact::report as contact_report;
use crate::rooms::study as contact_rooms_study;
use anyhow::{Context, ensure};
use hwall_testkit::Machine;
use std::path::Path;

/// Writes the document; recordings are left out where there are none. Figures, scores and predictions go
/// to `out`.
///
/// # Errors
/// A protocol that fails, a file that cannot be written.
pub fn write(
    file: &Path,
    choice: Choice,
    candidates: &[Candidate],
    recordings: Option<&Path>,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    // Known before minutes of work, not after.
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
        Machine::detect(choice.seed)
    );
    text += &contact_dissertation::report(choice, candidates, out)?;
    text += "\n";
    text += &contact_rooms_study::report(choice.seed, out)?;
    if let Some(dir) = recordings {
        text += "\n";
        text += &contact_report::recordings(dir, candidates, out)?;
    }
    std::fs::write(file, text).with_context(|| file.display().to_string())
}
