//! Error and coverage of the predicted end point against the share of a motion that was seen.

use crate::bip_report::short;
use crate::bip_run::TestRun;
use crate::bip_scores::{Accuracy, INTERVALS, Side, kinds};
use crate::figures::{COLOURS, TEXT, TITLE, legend, plot_error};
use hwall_testkit::quantile;
use plotters::prelude::*;
use std::path::Path;

/// Shares that are drawn, per cent.
fn percents() -> impl Iterator<Item = usize> {
    (2..=100).step_by(2)
}

/// Errors below this share of the largest are drawn at it: a logarithmic axis has no zero.
const SMALLEST: f64 = 1e-4;

/// Distance of the predicted from the true end point: median, 25 to 75 % and 5 to 95 % of the
/// motions, one panel a side; the medians of the kinds of motion as lines, where known.
///
/// # Errors
/// A file that cannot be written.
pub fn errors(path: &Path, sides: &[Side], runs: &[TestRun]) -> anyhow::Result<()> {
    let height = 400;
    let root = SVGBackend::new(path, (860, height * sides.len() as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    for (panel, side) in root.split_evenly((sides.len(), 1)).iter().zip(sides) {
        errors_panel(panel, side, runs)?;
    }
    root.present().map_err(plot_error)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn errors_panel(area: &Area<'_>, side: &Side, runs: &[TestRun]) -> anyhow::Result<()> {
    let curves = |kind: Option<&str>, levels: &[f64]| -> Vec<Vec<(f64, f64)>> {
        let own = || {
            runs.iter()
                .filter(|t| kind.is_none() || t.kind.as_deref() == kind)
        };
        let mut curves = vec![Vec::new(); levels.len()];
        for percent in percents() {
            let distances = Accuracy::at(own(), side, percent).distances;
            for (curve, level) in curves.iter_mut().zip(levels) {
                if !distances.is_empty() {
                    curve.push((percent as f64, quantile(&distances, *level)));
                }
            }
        }
        curves
    };
    let all = curves(None, &[0.05, 0.25, 0.5, 0.75, 0.95]);
    let highest = all.iter().flatten().fold(0.0, |m: f64, p| m.max(p.1));
    let highest = if highest > 0.0 { highest } else { 1.0 };
    let floor = SMALLEST * highest;
    let lift = |curve: &[(f64, f64)]| -> Vec<(f64, f64)> {
        curve.iter().map(|p| (p.0, p.1.max(floor))).collect()
    };
    let lowest = all.iter().flatten().fold(highest, |m, p| m.min(p.1));
    let y = lowest.max(floor) / 1.4..highest * 1.4;
    let title = format!(
        "End point, {} degrees of freedom ({}): {} motions",
        side.dofs.len(),
        side.name,
        runs.len()
    );
    let mut chart = ChartBuilder::on(area)
        .caption(title, TITLE)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(84)
        .build_cartesian_2d(0.0..100.0, y.log_scale())
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("samples seen, %")
        .y_desc("distance, columns' unit")
        .y_label_formatter(&|v| short(*v))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let blue = COLOURS[0];
    for (low, high, shade, label) in [
        (0, 4, 0.14, "5 to 95 % of the motions"),
        (1, 3, 0.28, "25 to 75 %"),
    ] {
        let mut outline = lift(&all[low]);
        outline.extend(lift(&all[high]).into_iter().rev());
        chart
            .draw_series([Polygon::new(outline, blue.mix(shade))])
            .map_err(plot_error)?
            .label(label)
            .legend(move |(x, y)| {
                Rectangle::new([(x, y - 5), (x + 18, y + 5)], blue.mix(shade).filled())
            });
    }
    chart
        .draw_series(LineSeries::new(lift(&all[2]), blue.stroke_width(3)))
        .map_err(plot_error)?
        .label("median")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], blue.stroke_width(3)));
    for (kind, colour) in kinds(runs).into_iter().zip(&COLOURS[1..]) {
        let median = lift(&curves(Some(kind), &[0.5])[0]);
        chart
            .draw_series(LineSeries::new(median, colour.stroke_width(2)))
            .map_err(plot_error)?
            .label(format!("median, {kind}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    legend(&mut chart, SeriesLabelPosition::LowerLeft)
}

/// Share of the true end points within the 50 % and 90 % intervals; right is where the dashed
/// lines are.
///
/// # Errors
/// A file that cannot be written.
pub fn coverage(path: &Path, sides: &[Side], runs: &[TestRun]) -> anyhow::Result<()> {
    let root = SVGBackend::new(path, (860, 440)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(
            format!("True end points in the intervals: {} motions", runs.len()),
            TITLE,
        )
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..100.0, 0.0..100.0)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("samples seen, %")
        .y_desc("end points within, %")
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    for (share, _) in INTERVALS {
        let line = [(0.0, 100.0 * share), (100.0, 100.0 * share)];
        chart
            .draw_series(DashedLineSeries::new(line, 6, 5, BLACK.mix(0.6).into()))
            .map_err(plot_error)?;
    }
    let mut colours = COLOURS.iter();
    for side in sides {
        for (i, (share, _)) in INTERVALS.iter().enumerate().rev() {
            let Some(colour) = colours.next() else { break };
            let points = percents()
                .map(|p| (p as f64, 100.0 * Accuracy::at(runs, side, p).covered[i]))
                .filter(|p| p.1.is_finite());
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .map_err(plot_error)?
                .label(format!("{:.0} % interval, {}", 100.0 * share, side.name))
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
        }
    }
    legend(&mut chart, SeriesLabelPosition::LowerLeft)?;
    root.present().map_err(plot_error)
}
