//! What it costs to send fewer boards for nothing: the study at several losses of a false dispatch.

use super::study::{self, Request, Results};
use crate::documents::Documents;
use crate::report::page;
use anyhow::ensure;
use hwall::PolicyConfig;
use hwall_stage::figures::{COLOURS, legend};
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::report::figure::{Axes, DEFAULT_SIZE, Plot, figure, named_line};
use hwall_stage::report::summary::Summary;
use hwall_testkit::{MarkdownTable, cells, or_none};
use plotters::prelude::{BLACK, Circle, Color, SeriesLabelPosition};
use std::path::{Path, PathBuf};

/// The name of the document.
pub const NAME: &str = "TRADE-OFF.md";

/// Results at one loss of a false dispatch.
pub type Point = (f64, Results);

/// Runs the study at every loss, touches.
///
/// # Errors
/// As for [`study::run`]; a loss that is negative or NaN.
pub fn run(
    request: &Request,
    losses: &[f64],
    mut progress: impl FnMut(PersonKind, f64),
) -> anyhow::Result<Vec<Point>> {
    let policy_of = |false_dispatch: f64| PolicyConfig {
        false_dispatch,
        ..request.policy
    };
    for loss in losses {
        policy_of(*loss).validate()?;
    }
    let at = |loss: &f64| {
        let request = Request {
            policy: policy_of(*loss),
            ..request.clone()
        };
        Ok((*loss, study::run(&request, &mut progress)?))
    };
    losses.iter().map(at).collect()
}

/// Of one kind: boards in vain for each touch, and the share in place of the possible touches, %.
fn ends(summary: &Summary) -> [Option<f64>; 2] {
    let in_place = summary.in_place_of_possible().map(|share| 1e2 * share);
    [summary.in_vain_per_touch, in_place]
}

/// One row for each loss.
#[must_use]
pub fn table(points: &[Point]) -> MarkdownTable {
    let kinds = points.iter().flat_map(|(_, results)| &results.rows);
    let kinds = kinds.take(points.first().map_or(0, |(_, results)| results.rows.len()));
    let titles = kinds.map(|row| format!("{}: of possible, %; in vain", row.kind.name()));
    let mut table = MarkdownTable::new(cells(["false dispatch"], titles));
    for (loss, results) in points {
        let of_kinds = results.rows.iter().map(|row| {
            let [in_vain, in_place] = ends(&row.summary);
            format!("{}; {}", or_none(in_place, 1), or_none(in_vain, 2))
        });
        table.row(cells([&*loss.to_string()], of_kinds));
    }
    table
}

/// A curve for each kind of people.
fn draw(path: &Path, points: &[Point]) -> anyhow::Result<()> {
    let kinds = points.first().map_or(0, |(_, results)| results.rows.len());
    let curve = |kind: usize| -> Vec<(f64, f64)> {
        let ends = points
            .iter()
            .map(|(_, results)| ends(&results.rows[kind].summary));
        ends.filter_map(|[x, y]| Some((x?, y?))).collect()
    };
    let all: Vec<_> = (0..kinds).flat_map(curve).collect();
    ensure!(!all.is_empty(), "no touch was possible: nothing to draw");
    let widest = all.iter().map(|p| p.0).fold(0.1, f64::max);
    let lowest = all.iter().map(|p| p.1).fold(95.0, f64::min);
    figure(path, DEFAULT_SIZE, |root| {
        let axes = Axes {
            title: "In place, against boards in vain",
            names: [
                "boards in vain for each touch",
                "in place, of the possible touches, %",
            ],
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..1.05 * widest, lowest - 2.0..100.0)?;
        for (kind, colour) in (0..kinds).zip(COLOURS.iter().cycle()) {
            let style = colour.stroke_width(2);
            chart.line(curve(kind), style)?;
            let dots = curve(kind);
            let dots = dots
                .into_iter()
                .map(|at| Circle::new(at, 3, colour.filled()));
            let name = points[0].1.rows[kind].kind.name();
            named_line(chart.series(dots)?, name, style);
        }
        let nominal = points
            .iter()
            .filter(|(loss, _)| *loss == PolicyConfig::default().false_dispatch);
        let nominal = nominal.flat_map(|(_, results)| &results.rows);
        let rings = nominal.filter_map(|row| {
            let [x, y] = ends(&row.summary);
            Some(Circle::new((x?, y?), 6, BLACK.stroke_width(1)))
        });
        chart.series(rings)?;
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}

/// Writes the document with its figure.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    seed: u64,
    touches: usize,
    points: &[Point],
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    draw(&documents.figures("in-time")?.join("trade-off.svg"), points)?;
    let table = table(points);
    let page = page(
        include_str!("trade_off.md"),
        seed,
        &[("touches", &touches), ("table", &table)],
    )?;
    documents.write(NAME, &page)
}
