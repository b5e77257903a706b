//! What got through once, and the tests that hold it: an attack that succeeded stays a test of its own.

mod of_a_first_use;
mod of_files;
mod of_the_loop;

use hwall_testkit::MarkdownTable;
pub use of_a_first_use::OF_A_FIRST_USE;
pub use of_files::OF_FILES;
pub use of_the_loop::OF_THE_LOOP;

/// A class of inputs or faults that was not held once.
pub struct Finding {
    /// Its short name.
    pub id: &'static str,
    /// What happened.
    pub what: &'static str,
    /// Tests that fail without the mending: file, and name in it.
    pub tests: &'static [(&'static str, &'static str)],
}

const fn finding(
    id: &'static str,
    what: &'static str,
    tests: &'static [(&'static str, &'static str)],
) -> Finding {
    Finding { id, what, tests }
}

/// All of them.
pub fn all() -> impl Iterator<Item = &'static Finding> {
    [OF_THE_LOOP, OF_FILES, OF_A_FIRST_USE]
        .into_iter()
        .flatten()
}

/// The three tables with their headings, as they stand in the document.
#[must_use]
pub fn section() -> String {
    let mut text = "## What got through once\n\nEach line is a class that was not held, and the tests that fail without its mending.\n".to_owned();
    for (heading, findings) in [
        ("The control loop", OF_THE_LOOP),
        ("Files, numbers and command lines", OF_FILES),
        ("First use", OF_A_FIRST_USE),
    ] {
        let mut table = MarkdownTable::new(["", "what happened", "held by"]);
        for finding in findings {
            let tests = finding
                .tests
                .iter()
                .map(|(file, name)| format!("`{name}` ({file})"));
            table.row([
                finding.id.to_owned(),
                finding.what.to_owned(),
                tests.collect::<Vec<_>>().join(", "),
            ]);
        }
        text += &format!("\n### {heading}\n\n{table}");
    }
    text
}
