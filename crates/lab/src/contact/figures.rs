//! The study's figures: error against time to contact, and reliability (observed against stated probability).

use crate::contact::candidates::Role;
use crate::contact::run::Scores;
use hwall_contact::score::{BEFORE_S, Moment, REGIONS};
use hwall_stage::figures::{COLOURS, TEXT, legend};
use hwall_stage::report::figure::{
    Axes, Draw, Mesh, Plot, figure, log_ticks, named_line, tenths, whole,
};
use plotters::prelude::*;
use std::path::Path;

/// Smaller errors are drawn at this value, mm: a logarithmic axis has no zero.
const SMALLEST_MM: f64 = 2.0;

/// Colours of the competitors in every figure of the study, in their order.
fn colours() -> impl Iterator<Item = RGBColor> {
    COLOURS.into_iter().chain([BLACK]).cycle()
}

/// Scores with their colours.
fn competitors(scores: &[Scores]) -> impl Iterator<Item = (&Scores, RGBColor)> {
    scores.iter().zip(colours())
}

/// Times to contact, s, with the median errors there, m.
fn errors(scores: &Scores) -> impl Iterator<Item = (f64, f64)> + Clone {
    BEFORE_S.into_iter().filter_map(|before_s| {
        let summary = scores.at_moment(Moment::Before(before_s));
        (summary.count > 0).then_some((before_s, summary.median_m))
    })
}

/// Median error over the time to contact, the names to the right of the contact; a full line where covariances are stated.
///
/// # Errors
/// A file that cannot be written.
pub fn error_over_time(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<()> {
    let all = || scores.iter().flat_map(errors);
    let largest_mm = all().fold(100.0, |m: f64, p| m.max(1e3 * p.1));
    let earliest_ms = all().fold(100.0, |m: f64, p| m.max(1e3 * p.0));
    figure(path, (980, 540), |root| {
        let y = 0.9 * SMALLEST_MM..1.2 * largest_mm;
        let (drawing, beside) = root.split_horizontally(690);
        // Time runs to the right, towards the contact.
        let axes = Axes {
            title,
            names: [
                "time to contact, ms",
                &format!("median error of the predicted point, mm (at least {SMALLEST_MM})"),
            ],
            formats: [Some(&|x| format!("{:.0}", x.abs())), Some(&whole)],
            labels: [70, 52],
            mesh: Mesh::Across,
            ..Axes::default()
        };
        let mut chart = axes.on(
            &drawing,
            -earliest_ms * 1.02..0.0,
            y.clone().log_scale().with_key_points(log_ticks(&y, 3.0)),
        )?;
        for ((s, colour), y) in competitors(scores).zip((64..).step_by(24)) {
            let style = colour.stroke_width(if s.role == Role::Learned { 4 } else { 2 });
            let points = errors(s)
                .map(|(before_s, error_m)| (-1e3 * before_s, (1e3 * error_m).max(SMALLEST_MM)));
            let key = |from, to| beside.put(&PathElement::new([(from, y), (to, y)], style));
            if s.under_way().intervals.is_none() {
                chart.series(DashedLineSeries::new(points, 6, 5, style))?;
                key(8, 17).and(key(25, 34))?;
            } else {
                chart.series(LineSeries::new(points, style).point_size(3))?;
                key(8, 34)?;
            }
            beside.write(&s.name, TEXT, (44, y - 9))?;
        }
        Ok(())
    })
}

/// Observed over stated probability of the spatial regions, from 30 to 90 % of the time. Returns `false` without drawing
/// if no estimator states regions.
///
/// # Errors
/// A file that cannot be written.
pub fn reliability(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<bool> {
    let lines: Vec<(RGBColor, &str, [f64; REGIONS.len()])> = competitors(scores)
        .filter_map(|(s, colour)| Some((colour, s.name.as_str(), s.under_way().regions?)))
        .collect();
    if lines.is_empty() {
        return Ok(false);
    }
    figure(path, (680, 640), |root| {
        // Room for dots at 1.
        let axes = Axes {
            title,
            names: [
                "stated probability of the region",
                "share of the contacts in it",
            ],
            formats: [Some(&tenths), Some(&tenths)],
            numbers: [Some(6), Some(6)],
            beside: 26 - 14,
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..1.02, 0.0..1.02)?;
        chart.line([(0.0, 0.0), (1.0, 1.0)], BLACK.mix(0.4))?;
        for (colour, name, observed) in lines {
            let style = colour.stroke_width(3);
            let stated = REGIONS.iter().map(|r| r.probability);
            let line = LineSeries::new(stated.zip(observed), style).point_size(3);
            named_line(chart.series(line)?, name, style);
        }
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })?;
    Ok(true)
}
