//! The tables of the study, and the whole of docs/END-TO-END.md.

use super::ends::{EndError, EndErrors, SHARES};
use super::study::{Led, Request, Results, TOLD_AT, ToldApart};
use crate::documents::Documents;
use crate::report::{Column, Gap, fill, page, percent_of, quantiles, table_of};
use hwall_stage::run::judged::judge::Outcome;
use hwall_testkit::MarkdownTable;
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "END-TO-END.md";

/// Where the middle of the face would be, by how much of the reach was seen: median and nine of ten, mm.
fn ends_table(ends: &[EndErrors]) -> MarkdownTable {
    let shares = SHARES.map(|share| format!("{:.0} %", 100.0 * share));
    let last = [
        "gap, mm",
        "tilt, degrees",
        "90 % regions hold at 50 / 100 %, %",
    ];
    let columns = std::iter::once("middle of the face, mm".to_owned()).chain(shares);
    let mut table = MarkdownTable::new(columns.chain(last.map(str::to_owned)));
    for of in ends {
        let mut cells = vec![of.name.clone()];
        for errors in &of.at {
            cells.push(median_and_most(errors, 1e3, |e| Some(e.middle_m)));
        }
        let end = &of.at[SHARES.len() - 1];
        cells.push(median_and_most(end, 1e3, |e| Some(e.gap_m)));
        let tilt = |e: &EndError| e.tilt_rad.map(f64::to_degrees);
        cells.push(median_and_most(end, 1.0, tilt));
        let held = |errors: &[EndError]| {
            let known: Vec<bool> = errors.iter().filter_map(|e| e.is_in_region).collect();
            let inside = known.iter().filter(|inside| **inside).count();
            match known.len() {
                0 => "-".to_owned(),
                count => format!("{:.0}", 100.0 * inside as f64 / count as f64),
            }
        };
        cells.push(format!("{} / {}", held(&of.at[1]), held(end)));
        table.row(cells);
    }
    table
}

fn median_and_most(
    errors: &[EndError],
    factor: f64,
    of: impl Fn(&EndError) -> Option<f64>,
) -> String {
    pair(errors.iter().filter_map(of), factor)
}

/// Median and nine of ten.
fn pair(values: impl Iterator<Item = f64>, factor: f64) -> String {
    let [median, most] = quantiles(values, [0.5, 0.9]);
    match median.is_nan() {
        true => "-".to_owned(),
        false => format!("{:.1} / {:.1}", factor * median, factor * most),
    }
}

fn tasks_table(told: &[ToldApart]) -> MarkdownTable {
    let shares = TOLD_AT.map(|share| format!("right after {:.0} %, %", 100.0 * share));
    let columns = ["task".to_owned(), "reaches".to_owned()].into_iter();
    let last = "middle of the face at the end, mm".to_owned();
    let mut table = MarkdownTable::new(columns.chain(shares).chain([last]));
    for one in told {
        let mut cells = vec![one.task.name().to_owned(), one.reaches.to_string()];
        cells.extend(one.right.map(|right| percent(right, one.reaches)));
        let [median_m, most_m] = one.off_m;
        cells.push(format!("{:.1} / {:.1}", 1e3 * median_m, 1e3 * most_m));
        table.row(cells);
    }
    table
}

fn percent(part: usize, all: usize) -> String {
    percent_of(part, all, 0, "-")
}

/// Gaps that are counted besides that of a board in place, m.
const GAPS_M: [f64; 3] = [0.01, 0.02, 0.05];

fn touches_table(led: &[Led]) -> MarkdownTable {
    let gaps = GAPS_M.map(|gap_m| format!("under the hand within {:.0} cm, %", 100.0 * gap_m));
    let within =
        GAPS_M.map(|gap_m| move |led: &&Led| percent(led.within(gap_m), led.touches.len()));
    let all = |led: &Led| led.touches.len();
    let led_before = |led: &Led| {
        let led_s = led.touches.iter().filter_map(|t| t.regret.foreseen_s);
        match quantiles(led_s, [0.5])[0] {
            none if none.is_nan() => "-".to_owned(),
            median_s => format!("{:.0}", 1e3 * median_s),
        }
    };
    let of = |led: &Led, factor: f64, number: fn(&Outcome) -> f64| {
        pair(
            led.touches.iter().map(|touch| number(&touch.outcome)),
            factor,
        )
    };
    let predicted = |led: &Led| match quantiles(led.predicted_us.iter().copied(), [0.5, 0.99]) {
        [median, _] if median.is_nan() => "-".to_owned(),
        [median, most] => format!("{median:.1} / {most:.0}"),
    };
    let first: [Column<'_, &Led>; 4] = [
        ("person", &|led| led.kind.name().to_owned()),
        ("led by", &|led| led.leader.name().to_owned()),
        ("reachable", &|led| all(led).to_string()),
        ("in place, %", &|led| percent(led.in_place(), all(led))),
    ];
    let mut columns = first.to_vec();
    for (name, cell) in gaps.iter().zip(&within) {
        columns.push((name, cell));
    }
    let last: [Column<'_, &Led>; 7] = [
        ("felt, %", &|led| percent(led.felt(), all(led))),
        ("led there before, median, ms", &|led| led_before(led)),
        ("gap, mm", &|led| of(led, 1e3, |o| o.gap_m)),
        ("beside the middle, mm", &|led| of(led, 1e3, |o| o.offset_m)),
        ("tilt, degrees", &|led| {
            of(led, 1.0, |o| o.tilt_rad.to_degrees())
        }),
        ("prediction, us, median / p99", &|led| predicted(led)),
        ("of frames, %", &|led| {
            format!("{:.0}", 100.0 * led.inferring)
        }),
    ];
    columns.extend(last);
    table_of(led, &columns)
}

/// All tables, as they are printed and written.
///
/// # Errors
/// None: the gaps are those of tables.md.
pub fn text(request: &Request, results: &Results) -> anyhow::Result<String> {
    let gaps: [Gap<'_>; 7] = [
        ("demonstrations", &results.demonstrations),
        ("components", &results.components),
        ("held_out", &results.held_out),
        ("ends", &ends_table(&results.ends)),
        ("tasks", &tasks_table(&results.told_apart)),
        ("touches", &request.touches),
        ("touches_table", &touches_table(&results.led)),
    ];
    fill(include_str!("tables.md"), &gaps)
}

/// Writes the document.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    request: &Request,
    results: &Results,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let text = text(request, results)?;
    let page = page(
        include_str!("document.md"),
        request.seed,
        &[("tables", &text)],
    )?;
    documents.write(NAME, &page)
}
