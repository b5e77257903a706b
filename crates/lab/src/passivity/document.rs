//! The tables of the study, and the whole of docs/PASSIVITY.md.

use super::study::{FELT_J, LIMIT_CYCLE_M, NUMERICAL_J, Request, Row};
use crate::documents::Documents;
use crate::report::page;
use hwall_haptics::passivity::PassivityMethod;
use hwall_testkit::{Claim, Column, MarkdownTable, claims, table_of};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "PASSIVITY.md";

/// One row for each causality and method.
pub fn contact_table(rows: &[Row]) -> MarkdownTable {
    let intrusion = |r: &Row, place: usize| format!("{:.2}", 1e2 * r.intrusion[place]);
    let columns: [Column<'_, &Row>; 12] = [
        ("causality", &|r| {
            format!("{:?}", r.causality).to_lowercase()
        }),
        ("method", &|r| r.method.name().to_owned()),
        ("contacts", &|r| r.contacts.to_string()),
        ("failed", &|r| r.failed.to_string()),
        ("generating", &|r| r.generating.to_string()),
        ("more than 1 mJ", &|r| r.felt.to_string()),
        ("most, J", &|r| format!("{:.2e}", r.most_j)),
        ("limit cycles", &|r| r.cycling.to_string()),
        ("largest swing, mm", &|r| {
            format!("{:.2}", 1e3 * r.largest_swing_m)
        }),
        ("taken off, mean, %", &|r| intrusion(r, 0)),
        ("median, %", &|r| intrusion(r, 1)),
        ("nine of ten, %", &|r| intrusion(r, 2)),
    ];
    table_of(rows, &columns)
}

/// The claims of the study, and whether they hold.
pub fn verdicts(rows: &[Row]) -> MarkdownTable {
    let sum = |method: PassivityMethod, f: &dyn Fn(&Row) -> usize| -> usize {
        rows.iter().filter(|row| row.method == method).map(f).sum()
    };
    let default = PassivityMethod::default();
    let generating = sum(default, &|row| row.generating);
    let cycling = sum(default, &|row| row.cycling);
    let without = sum(PassivityMethod::Off, &|row| row.failed);
    let name = default.name();
    claims(
        "claim | measured | holds",
        [
            Claim::new(
                format!("{name}: no contact generates more than {NUMERICAL_J:.0e} J"),
                format!("{generating} do"),
                generating == 0,
            ),
            Claim::new(
                format!("{name}: no limit cycle above {} mm", 1e3 * LIMIT_CYCLE_M),
                format!("{cycling} are"),
                cycling == 0,
            ),
            Claim::new(
                "without, the same contacts fail (the check can)",
                format!("{without} do"),
                without > 0,
            ),
        ],
    )
}

/// All tables, as they are printed and written.
pub fn text(request: &Request, rows: &[Row]) -> String {
    format!(
        "{} contacts at random, each with and without the tank and with the same noise. Failed: more than {NUMERICAL_J:.0e} J \
         generated, or a swing above {} mm that goes on; felt: more than {} mJ.\n\n{}\n{}",
        request.contacts,
        1e3 * LIMIT_CYCLE_M,
        1e3 * FELT_J,
        verdicts(rows),
        contact_table(rows),
    )
}

/// Writes the document.
///
/// # Errors
/// A file that cannot be written.
pub fn write(request: &Request, rows: &[Row], documents: &Documents) -> anyhow::Result<PathBuf> {
    let template = include_str!("document.md");
    let text = page(template, request.seed).fill(&[("tables", &text(request, rows))])?;
    documents.write(NAME, &text)
}
