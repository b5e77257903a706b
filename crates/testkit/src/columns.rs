//! Tables from columns, and the numbers in them.

use crate::stats::quantile;
use crate::table::MarkdownTable;

/// A table without rows: `titles` of the columns, separated by ` | `.
#[must_use]
pub fn titled(titles: &str) -> MarkdownTable {
    MarkdownTable::new(titles.split(" | "))
}

/// A column: its title, and the cell of a row in it.
pub type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> String);

/// A table with one row for each of `rows`.
pub fn table_of<T>(rows: impl IntoIterator<Item = T>, columns: &[Column<'_, T>]) -> MarkdownTable {
    let mut table = MarkdownTable::new(columns.iter().map(|(title, _)| *title));
    for row in rows {
        table.row(columns.iter().map(|(_, cell)| cell(&row)));
    }
    table
}

/// A table with one row for each of `rows`: a name, under the title `first`, and a cell for each of `across`.
pub fn grid<T, A: Copy>(
    first: &str,
    across: &[A],
    title: impl Fn(A) -> String,
    rows: impl IntoIterator<Item = T>,
    name: impl Fn(&T) -> String,
    cell: impl Fn(&T, A) -> String,
) -> MarkdownTable {
    let titles = across.iter().map(|a| title(*a));
    let mut table = MarkdownTable::new(cells([first], titles));
    for row in rows {
        let own = across.iter().map(|a| cell(&row, *a));
        table.row(cells([&name(&row)], own));
    }
    table
}

/// Concatenates cells.
#[must_use]
pub fn cells<const N: usize>(
    first: [&str; N],
    more: impl IntoIterator<Item = String>,
) -> Vec<String> {
    let first = first.into_iter().map(str::to_owned);
    first.chain(more).collect()
}

/// A number with `decimals` decimals; `none` without one.
#[must_use]
pub fn or_none(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "none".to_owned(), |v| format!("{v:.decimals$}"))
}

/// A claim, the measurement, and whether it is within the bound.
pub struct Claim {
    /// The claim with its bound.
    pub what: String,
    /// The measurement with its unit.
    pub measured: String,
    /// Is the measurement within the bound?
    pub holds: bool,
}

impl Claim {
    /// A claim.
    pub fn new(what: impl Into<String>, measured: impl Into<String>, holds: bool) -> Self {
        Self {
            what: what.into(),
            measured: measured.into(),
            holds,
        }
    }
}

/// The table of claims, under these three titles.
pub fn claims(titles: &str, claims: impl IntoIterator<Item = Claim>) -> MarkdownTable {
    let mut table = titled(titles);
    for claim in claims {
        let holds = yes_or_no(claim.holds);
        table.row([claim.what, claim.measured, holds.to_owned()]);
    }
    table
}

/// `yes`, or `no`.
#[must_use]
pub const fn yes_or_no(yes: bool) -> &'static str {
    match yes {
        true => "yes",
        false => "no",
    }
}

/// Per cent with `decimals` decimals; `none` if `all` is zero.
#[must_use]
pub fn percent_of(part: usize, all: usize, decimals: usize, none: &str) -> String {
    match all {
        0 => none.to_owned(),
        _ => format!("{:.decimals$}", 100.0 * part as f64 / all as f64),
    }
}

/// Quantiles of values in any order; NaN without values.
pub fn quantiles<const N: usize>(values: impl IntoIterator<Item = f64>, at: [f64; N]) -> [f64; N] {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    at.map(|p| quantile(&sorted, p))
}
