//! The document of the contact study: all protocols in one file.

use crate::contact::candidates::Candidate;
use crate::contact::dissertation::{self, Overrides};
use crate::contact::recordings::Recorded;
use crate::contact::report::{self, Choice};
use crate::contact::tables;
use crate::report::page;
use crate::rooms::study;
use anyhow::{Context, ensure};
use std::path::Path;

/// The name of the page.
pub const NAME: &str = "CONTACT-STUDY.md";
/// The name of the document with its tables.
pub const TABLES: &str = "CONTACT-TABLES.md";
/// Reaches of the simulated study of pointing in the document: a third of the full study.
const POINTING_REACHES: usize = 13 * 40;
/// Least number of reaches for a learning curve.
const LEAST_FOR_A_CURVE: usize = 200;

/// Writes the page, and a second document with all tables, including the recordings if given. Figures, scores and predictions go
/// to `out`.
///
/// # Errors
/// A protocol that fails, a file that cannot be written.
pub fn write(
    file: &Path,
    overrides: Overrides,
    candidates: &[Candidate],
    recorded: Option<Recorded<'_>>,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    // Check before minutes of work, not after.
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
    ensure!(
        folder.is_none_or(Path::is_dir) && !file.is_dir(),
        "{}: no file can be written there",
        file.display()
    );
    let all = Choice::default();
    let pointing = Overrides {
        reaches: overrides.reaches.or(Some(POINTING_REACHES)),
        ..overrides
    };
    let mut sections = vec![
        dissertation::report(overrides, candidates, &all, out)?,
        dissertation::pointing(pointing, candidates, &all, out)?,
    ];
    if let Some(recorded) = recorded {
        sections.push(report::recordings(recorded, candidates, &all, out)?);
    }
    let rooms = study::report(overrides.seed)?;
    let texts: String = sections.iter().map(|s| s.text.clone() + "\n").collect();
    let sets: Vec<_> = sections.into_iter().flat_map(|s| s.sets).collect();
    let mut adapting = sets.iter().filter_map(|(name, scores)| {
        let (s, told) = scores.iter().find_map(|s| Some((s, s.told.as_ref()?)))?;
        let enough = told.reaches.len() >= LEAST_FOR_A_CURVE;
        let curve = tables::curve(&s.alone, told);
        enough.then(|| {
            format!("\n### What touches teach: {name}\n\n30 to 90 % of the time.\n\n{curve}")
        })
    });
    let text = page(
        include_str!("contact_study.md"),
        overrides.seed,
        &[
            ("overview", &tables::overview(&sets)),
            // One set is enough.
            ("adapting", &adapting.next().unwrap_or_default()),
            ("rooms", &rooms.trim_end()),
        ],
    )?;
    let tables = page(
        include_str!("contact_tables.md"),
        overrides.seed,
        &[("sections", &texts.trim_end())],
    )?;
    for (path, text) in [
        (file.to_owned(), text),
        (file.with_file_name(TABLES), tables),
    ] {
        hwall_files::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}
