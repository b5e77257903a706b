//! What the documents of studies have in common: the page around their tables, and the table of costs.

use crate::documents::Documents;
use crate::report::{Column, page, table_of};
use hwall_testkit::{MarkdownTable, Timing, format_ns};
use std::path::PathBuf;

/// Writes the document `name`: the template with the text of a study in its gap `tables`.
///
/// # Errors
/// A file that cannot be written, a template with other gaps.
pub fn write_tables(
    documents: &Documents,
    name: &str,
    template: &str,
    seed: u64,
    tables: &str,
) -> anyhow::Result<PathBuf> {
    documents.write(name, &page(template, seed, &[("tables", &tables)])?)
}

/// Median and tail of each of `rows`, under this title.
pub fn costs<S: ToString>(title: &str, rows: &[(S, Timing)]) -> MarkdownTable {
    let columns: [Column<'_, &(S, Timing)>; 3] = [
        (title, &|(what, _)| what.to_string()),
        ("median", &|(_, timing)| format_ns(timing.median_ns)),
        ("p99", &|(_, timing)| format_ns(timing.p99_ns)),
    ];
    table_of(rows, &columns)
}
