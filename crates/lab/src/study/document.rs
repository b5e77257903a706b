//! The document of the contact study: all protocols in one file.

use crate::contact::candidates::Candidate;
use crate::contact::dissertation::{self, Overrides};
use crate::contact::recordings::Recorded;
use crate::contact::report::{self, Choice};
use crate::contact::tables;
use crate::documents::written_by;
use crate::rooms::{registration, study};
use anyhow::{Context, ensure};
use hwall_testkit::Machine;
use std::path::Path;

/// The name of the page.
pub const NAME: &str = "CONTACT-STUDY.md";
/// The name of the tables behind it.
pub const TABLES: &str = "CONTACT-TABLES.md";
/// Reaches of the simulated study of pointing in the document: a third of the full study.
const POINTING_REACHES: usize = 13 * 40;

/// Writes the page, and all tables beside it, with the recordings if there are any. Figures, scores and predictions go
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
    // Said before minutes of work, not after them.
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
    ensure!(
        folder.is_none_or(Path::is_dir) && !file.is_dir(),
        "{}: no file can be written there",
        file.display()
    );
    let machine = format!(
        "{} {}. Simulated people are drawn from the seed; those \
         judged are never those learnt from.",
        written_by(),
        Machine::detect(overrides.seed)
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
    let rooms = study::report(overrides.seed, out)?;
    let mut tables = format!("# Where, when and which surface: all tables\n\n{machine}\n\n");
    for section in &sections {
        tables = tables + &section.text + "\n";
    }
    tables += &rooms;
    let sets: Vec<_> = sections.into_iter().flat_map(|s| s.sets).collect();
    let mut page = format!(
        "# Where, when and which surface: the study\n\n{machine} The moment is never told to an estimator. All \
         tables: [{TABLES}]({TABLES}).\n\n## Where does a reach end?\n\n{}",
        tables::overview(&sets)
    );
    for (name, scores) in &sets {
        let adapting = scores.iter().find_map(|s| s.adapting.as_ref());
        if let Some(adapting) = adapting.filter(|a| a.told.reaches.len() >= LEAST_FOR_A_CURVE) {
            page += &format!(
                "\n### What touches teach: {name}\n\n30 to 90 % of the time.\n\n{}",
                tables::curve(adapting)
            );
            // One set says what there is to say.
            break;
        }
    }
    page += &format!("\n## Which surface?\n\n{}", section(&rooms, SHORT));
    page += &format!(
        "\n## A tracker that is off\n\n{}",
        section(&rooms, registration::HEADING)
    );
    for (path, text) in [
        (file.to_owned(), page),
        (file.with_file_name(TABLES), tables),
    ] {
        hwall_files::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Fewer reaches show no curve.
const LEAST_FOR_A_CURVE: usize = 200;

/// The part of a study of rooms under a heading that begins so.
fn section(rooms: &str, heading: &str) -> String {
    let from = rooms.find(heading).map_or(0, |at| at + heading.len());
    let rest = rooms[from..].trim_start();
    // The rest of a heading stands on its line.
    let rest = match rooms[from..].starts_with('\n') {
        true => rest,
        false => rest.split_once('\n').map_or(rest, |(_, rest)| rest),
    };
    let end = rest.find("\n### ").unwrap_or(rest.len());
    rest[..end].trim().to_owned() + "\n"
}

/// The heading of the part that says it in short.
const SHORT: &str = "### In short";
