//! The tables of the study, and the whole of docs/ENVIRONMENTS.md.

use crate::documents::Documents;
use crate::environment::figures;
use crate::environment::modes::Mode;
use crate::environment::outcome::OutOfReach;
use crate::environment::speed::Cost;
use crate::environment::study::{Request, Results, Row};
use crate::environment::summary::Summary;
use crate::environment::touch_file;
use crate::report::{Column, page, percent_of, table_of};
use hwall_arrival::WaitingPosture;
use hwall_testkit::{MarkdownTable, format_ns};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "ENVIRONMENTS.md";
/// The folder of its figures.
const FIGURES: &str = "environments";

fn number(value: f64, decimals: usize) -> String {
    match value.is_nan() {
        true => "none".to_owned(),
        false => format!("{value:.decimals$}"),
    }
}

fn percent(part: usize, of: usize) -> String {
    percent_of(part, of, 1, "none")
}

/// A row, and its touches in numbers.
type Judged<'a> = (&'a Row, Summary);

fn hand(row: &Row) -> String {
    if row.shifted { "shifted" } else { "as it is" }.to_owned()
}

/// The first cells of every row.
fn head<'a>() -> [Column<'a, &'a Judged<'a>>; 3] {
    [
        ("person", &|(row, _)| row.person.name().to_owned()),
        ("orientation", &|(row, _)| row.mode.name().to_owned()),
        ("hand", &|(row, _)| hand(row)),
    ]
}

/// How many touches are presented in time, and how parallel.
fn outcomes(rows: &[Judged<'_>]) -> MarkdownTable {
    let columns: [Column<'_, &Judged<'_>>; 11] = [
        ("in time, %", &|(_, s)| percent(s.in_time, s.all)),
        ("in time and parallel, %", &|(_, s)| {
            percent(s.in_time_parallel, s.all)
        }),
        ("late, %", &|(_, s)| percent(s.in_reach - s.in_time, s.all)),
        ("out of reach, %", &|(_, s)| {
            percent(s.all - s.in_reach, s.all)
        }),
        ("in time, of those within reach, %", &|(_, s)| {
            percent(s.in_time, s.in_reach)
        }),
        ("residual angle: median", &|(_, s)| {
            number(s.residual_deg[0], 1)
        }),
        ("p90", &|(_, s)| number(s.residual_deg[1], 1)),
        ("max, degrees", &|(_, s)| number(s.residual_deg[2], 1)),
        ("avatar turned: median", &|(_, s)| {
            number(s.turned_deg[0], 1)
        }),
        ("p90", &|(_, s)| number(s.turned_deg[1], 1)),
        ("max, degrees", &|(_, s)| number(s.turned_deg[2], 1)),
    ];
    table_of(rows, &[&head()[..], &columns].concat())
}

/// Why touches are out of reach.
fn reasons(rows: &[Judged<'_>]) -> MarkdownTable {
    let mut columns = head().to_vec();
    columns.push(("touches", &|(_, s)| s.all.to_string()));
    columns.push(("out of reach", &|(_, s)| (s.all - s.in_reach).to_string()));
    let cells: [_; 8] =
        std::array::from_fn(|k| move |(_, s): &&Judged<'_>| s.reasons[k].to_string());
    for (name, cell) in OutOfReach::NAMES.iter().zip(&cells) {
        columns.push((*name, cell));
    }
    table_of(rows, &columns)
}

/// What shifted hands add.
fn shifts(rows: &[Judged<'_>]) -> MarkdownTable {
    let more = |(row, s): &Judged<'_>| {
        let same = |other: &Row| !other.shifted && other.mode == row.mode && other.way == row.way;
        let without = rows.iter().find(|(other, _)| same(other));
        without.map_or(f64::NAN, |(_, w)| {
            100.0 * (s.in_time as f64 - w.in_time as f64) / s.all as f64
        })
    };
    let columns: [Column<'_, &Judged<'_>>; 11] = [
        ("brought in time: late ones", &|(_, s)| {
            s.from_late.to_string()
        }),
        ("out of reach", &|(_, s)| s.from_out_of_reach.to_string()),
        ("more in time, percentage points", &|row| {
            number(more(row), 1)
        }),
        ("shift: median", &|(_, s)| number(s.shift_mm[0], 0)),
        ("p90", &|(_, s)| number(s.shift_mm[1], 0)),
        ("max, mm", &|(_, s)| number(s.shift_mm[2], 0)),
        ("angle: median", &|(_, s)| number(s.shift_deg[0], 1)),
        ("max, degrees", &|(_, s)| number(s.shift_deg[1], 1)),
        ("gain: least", &|(_, s)| number(s.gain[0], 2)),
        ("largest", &|(_, s)| number(s.gain[1], 2)),
        (
            "travel time saved by the best shift, median of late ones, %",
            &|(_, s)| number(100.0 * s.saved, 1),
        ),
    ];
    let shifted = rows.iter().filter(|(row, _)| row.shifted);
    table_of(shifted, &[&head()[..2], &columns].concat())
}

fn costs(results: &Results) -> MarkdownTable {
    let columns: [Column<'_, &Cost>; 3] = [
        ("step", &|cost| cost.what.to_owned()),
        ("median", &|cost| format_ns(cost.timing.median_ns)),
        ("p99", &|cost| format_ns(cost.timing.p99_ns)),
    ];
    table_of(&results.speed, &columns)
}

/// All tables, as they are printed and written.
pub fn text(results: &Results) -> String {
    let rows: Vec<Judged<'_>> = results
        .rows
        .iter()
        .map(|row| (row, Summary::new(&row.touches)))
        .collect();
    format!(
        "{}.\n\n{}\n{}\n{}\n{}\n{}",
        results.journey,
        times(results, &rows),
        outcomes(&rows),
        reasons(&rows),
        shifts(&rows),
        costs(results)
    )
}

/// How much time there is, and where the arm waits.
fn times(results: &Results, rows: &[Judged<'_>]) -> MarkdownTable {
    let waits = |waiting: &WaitingPosture| waiting.q.0.map(|q| format!("{:.0}", q.to_degrees()));
    let exact = rows
        .iter()
        .filter(|(row, _)| row.mode == Mode::Exact && !row.shifted);
    let columns: [Column<'_, (&Judged<'_>, &WaitingPosture)>; 5] = [
        ("person", &|((row, _), _)| row.person.name().to_owned()),
        ("time for the arm's way: median", &|((_, s), _)| {
            number(s.budget_s[0], 2)
        }),
        ("less in one of ten, s", &|((_, s), _)| {
            number(s.budget_s[1], 2)
        }),
        ("least time of the way, median, s", &|((_, s), _)| {
            number(s.travel_s, 2)
        }),
        ("the arm waits at, degrees", &|(_, waiting)| {
            waits(waiting).join(", ")
        }),
    ];
    table_of(exact.zip(&results.waiting), &columns)
}

/// Writes the document and its figures.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    request: &Request,
    results: &Results,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let folder = documents.figures(FIGURES)?;
    figures::plan(&folder.join("plan.svg"), results)?;
    figures::from_the_arm(&folder.join("arm.svg"), results)?;
    // Half a megabyte: not among the tracked documents.
    if documents.readme().is_none() {
        touch_file::write(&documents.folder().join("touches.csv"), results)?;
    }
    let text = text(results);
    let page = page(
        include_str!("document.md"),
        request.seed,
        &[("tables", &text)],
    )?;
    documents.write(NAME, &page)
}
