//! The tables of the study, and the whole of docs/END-TO-END.md.

use super::study::{EndError, EndErrors, Led, Request, Results, SHARES, TOLD_AT, ToldApart};
use crate::documents::Documents;
use crate::report::{page, template};
use hwall_stage::run::evaluation::judge::Outcome;
use hwall_testkit::{Column, MarkdownTable, percent_of, quantiles, table_of, titled};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "END-TO-END.md";

/// Error of the middle of the face by the observed share of the reach: median and 90th percentile, mm.
fn ends_table(ends: &[EndErrors]) -> MarkdownTable {
    let shares = SHARES
        .map(|share| format!("{:.0} %", 100.0 * share))
        .join(" | ");
    let mut table = titled(&format!(
        "middle of the face, mm | {shares} | gap, mm | tilt, degrees | 90 % regions hold at 50 / 100 %, %"
    ));
    let held = |errors: &[EndError]| {
        let known = || errors.iter().filter_map(|e| e.is_in_region);
        percent(known().filter(|inside| *inside).count(), known().count())
    };
    for EndErrors { name, at } in ends {
        let end = &at[SHARES.len() - 1];
        let mut cells = vec![name.clone()];
        cells.extend(
            at.each_ref()
                .map(|errors| pair(errors.iter().map(|e| e.middle_m), 1e3)),
        );
        cells.push(pair(end.iter().map(|e| e.gap_m), 1e3));
        let tilts = end.iter().filter_map(|e| e.tilt_rad);
        cells.push(pair(tilts.map(f64::to_degrees), 1.0));
        cells.push(format!("{} / {}", held(&at[1]), held(end)));
        table.row(cells);
    }
    table
}

/// Median and 90th percentile.
fn pair(values: impl Iterator<Item = f64>, factor: f64) -> String {
    let [median, most] = quantiles(values, [0.5, 0.9]);
    match median.is_nan() {
        true => "-".to_owned(),
        false => format!("{:.1} / {:.1}", factor * median, factor * most),
    }
}

fn tasks_table(told: &[ToldApart]) -> MarkdownTable {
    let shares = TOLD_AT
        .map(|share| format!("right after {:.0} %, %", 100.0 * share))
        .join(" | ");
    let mut table = titled(&format!(
        "task | reaches | {shares} | middle of the face at the end, mm"
    ));
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

/// Gaps that are counted, besides that of a board in place, m.
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
        let outcomes = led.touches.iter().map(|touch| &touch.outcome);
        pair(outcomes.map(number), factor)
    };
    let tilt_deg = |outcome: &Outcome| outcome.tilt_rad.to_degrees();
    let inferring = |led: &Led| format!("{:.0}", 100.0 * led.inferring);
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
        ("tilt, degrees", &|led| of(led, 1.0, tilt_deg)),
        ("prediction, us, median / p99", &|led| predicted(led)),
        ("of frames, %", &|led| inferring(led)),
    ];
    columns.extend(last);
    table_of(led, &columns)
}

/// All tables, as they are printed and written.
///
/// # Errors
/// None: the gaps match tables.md.
pub fn text(request: &Request, results: &Results) -> anyhow::Result<String> {
    template(include_str!("tables.md")).fill(&[
        ("demonstrations", &results.demonstrations),
        ("components", &results.components),
        ("held_out", &results.held_out),
        ("ends", &ends_table(&results.ends)),
        ("tasks", &tasks_table(&results.told_apart)),
        ("touches", &request.touches),
        ("touches_table", &touches_table(&results.led)),
    ])
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
    let tables = text(request, results)?;
    let text = page(include_str!("document.md"), request.seed).fill(&[("tables", &tables)])?;
    documents.write(NAME, &text)
}
