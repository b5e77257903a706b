//! Error and coverage of the predicted end point against the observed share of a motion.

use crate::bip::run::TestRun;
use crate::bip::scores::{Accuracy, DofSet, INTERVALS, kinds};
use hwall_stage::figures::{COLOURS, Sign, legend_beside};
use hwall_stage::report::figure::{Area, Axes, Plot, figure, log_ticks, whole};
use hwall_testkit::quantile;
use plotters::prelude::*;
use std::path::Path;

/// Plotted shares, per cent.
fn percents() -> impl Iterator<Item = usize> {
    (2..=100).step_by(2)
}

/// Errors below this share of the largest are drawn at it: a logarithmic axis has no zero.
const SMALLEST: f64 = 1e-4;

/// Distance of the predicted from the true end point: median, 25 to 75 % and 5 to 95 % of the
/// motions, one panel per set; medians of each kind of motion as lines, if known.
///
/// # Errors
/// A file that cannot be written.
pub fn errors(path: &Path, sets: &[DofSet], runs: &[TestRun]) -> anyhow::Result<()> {
    let height = 400;
    figure(path, (980, height * sets.len() as u32), |root| {
        for (panel, set) in root.split_evenly((sets.len(), 1)).iter().zip(sets) {
            errors_panel(panel, set, runs)?;
        }
        Ok(())
    })
}

/// Width of the key to the right of a chart, pixels: inside the chart it would hide curves.
const KEY_WIDTH: u32 = 235;

/// Names beside a chart, with their stroke or band.
fn key(area: &Area<'_>, entries: &[(String, ShapeStyle)]) -> anyhow::Result<()> {
    let left = (area.dim_in_pixel().0 - KEY_WIDTH) as i32 + 14;
    let keys = entries.iter().map(|(name, style)| {
        let width = if style.filled { 14 } else { style.stroke_width };
        (Sign::Line(width), style.color, name.as_str())
    });
    legend_beside(area, (left, 64), keys)
}

fn errors_panel(area: &Area<'_>, set: &DofSet, runs: &[TestRun]) -> anyhow::Result<()> {
    let curve = |kind: Option<&str>, level: f64| -> Vec<(f64, f64)> {
        let own = |t: &&TestRun| kind.is_none() || t.kind.as_deref() == kind;
        let at = |percent| {
            let own = runs.iter().filter(own);
            let distances = Accuracy::at(own, set, percent).distances;
            let known = !distances.is_empty();
            known.then(|| (percent as f64, quantile(&distances, level)))
        };
        percents().filter_map(at).collect()
    };
    let all = [0.05, 0.25, 0.5, 0.75, 0.95].map(|level| curve(None, level));
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
        set.dofs.len(),
        set.name,
        runs.len()
    );
    let axes = Axes {
        title: &title,
        names: ["samples seen, %", "distance, columns' unit"],
        formats: [Some(&whole), Some(&|v| v.to_string())],
        labels: [84, 52],
        beside: KEY_WIDTH - 14,
        ..Axes::default()
    };
    let mut chart = axes.on(
        area,
        0.0..100.0,
        y.clone().log_scale().with_key_points(log_ticks(&y, 2.5)),
    )?;
    let blue = COLOURS[0];
    let mut names = Vec::new();
    for (low, high, shade, name) in [
        (0, 4, 0.14, "5 to 95 % of motions"),
        (1, 3, 0.28, "25 to 75 %"),
    ] {
        let mut outline = lift(&all[low]);
        outline.extend(lift(&all[high]).into_iter().rev());
        let style = blue.mix(shade).filled();
        chart.series([Polygon::new(outline, style)])?;
        names.push((name.to_owned(), style));
    }
    let mut lines = vec![("median".to_owned(), all[2].clone(), blue.stroke_width(3))];
    for (kind, colour) in kinds(runs).into_iter().zip(COLOURS[1..].iter().cycle()) {
        // Longer names would leave the picture.
        let name: String = kind.chars().take(15).collect();
        let median = curve(Some(kind), 0.5);
        lines.push((format!("median, {name}"), median, colour.stroke_width(2)));
    }
    for (name, line, style) in lines {
        chart.line(lift(&line), style)?;
        names.push((name, style));
    }
    key(area, &names)
}

/// Share of the true end points within the 50 % and 90 % intervals, beside dashed lines at 50 % and 90 %.
///
/// # Errors
/// A file that cannot be written.
pub fn coverage(path: &Path, sets: &[DofSet], runs: &[TestRun]) -> anyhow::Result<()> {
    figure(path, (980, 440), |root| {
        let axes = Axes {
            title: &format!(
                "True end points in the intervals, dashed: as it should be ({} motions)",
                runs.len()
            ),
            names: ["samples seen, %", "end points within, %"],
            formats: [Some(&whole), Some(&whole)],
            beside: KEY_WIDTH - 14,
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..100.0, 0.0..100.0)?;
        for (share, _) in INTERVALS {
            let line = [(0.0, 100.0 * share), (100.0, 100.0 * share)];
            chart.series(DashedLineSeries::new(line, 6, 5, BLACK.mix(0.6).into()))?;
        }
        let mut names = Vec::new();
        let mut colours = COLOURS.iter();
        for set in sets {
            for (i, (share, _)) in INTERVALS.iter().enumerate().rev() {
                let Some(colour) = colours.next() else { break };
                let points = percents()
                    .map(|p| (p as f64, 100.0 * Accuracy::at(runs, set, p).covered[i]))
                    .filter(|p| p.1.is_finite());
                let style = colour.stroke_width(2);
                chart.line(points, style)?;
                let name = format!("{:.0} %, {}", 100.0 * share, set.name);
                names.push((name, style));
            }
        }
        key(root, &names)
    })
}
