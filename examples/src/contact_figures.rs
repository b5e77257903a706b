//! The study's figures: error against time to contact, and stated against observed probability.

use crate::contact_candidates::Role;
use crate::contact_moments::{BEFORE_S, Moment};
use crate::contact_scores::{REGIONS, Scores};
use crate::figures::{COLOURS, TEXT, TITLE, legend, plot_error};
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Errors below this are drawn at it, mm: a logarithmic axis has no zero.
const SMALLEST_MM: f64 = 3.0;

/// Median error over the time to contact of everyone but bounds; whoever states a covariance has a full
/// line.
///
/// # Errors
/// A file that cannot be written.
pub fn error_over_time(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<()> {
    let competitors: Vec<&Scores> = scores.iter().filter(|s| s.role != Role::Bound).collect();
    let lines: Vec<Vec<(f64, f64)>> = competitors
        .iter()
        .map(|s| {
            let at = |before_s: f64| {
                let summary = s.at_moment(Moment::Before(before_s));
                let median_mm = (1e3 * summary.median_m).max(SMALLEST_MM);
                (summary.count > 0).then_some((1e3 * before_s, median_mm))
            };
            BEFORE_S.into_iter().filter_map(at).collect()
        })
        .collect();
    let largest = lines.iter().flatten().fold(100.0, |m: f64, p| m.max(p.1));
    let earliest = lines.iter().flatten().fold(100.0, |m: f64, p| m.max(p.0));
    let root = SVGBackend::new(path, (960, 560)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let y = 0.9 * SMALLEST_MM..1.2 * largest;
    // Room on the right for the legend; time runs to the right, towards the contact.
    let mut chart = ChartBuilder::on(&root)
        .caption(title, TITLE)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(70)
        .build_cartesian_2d(
            -earliest * 1.02..0.62 * earliest,
            y.clone().log_scale().with_key_points(error_ticks(&y)),
        )
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_desc("time to contact, ms")
        .y_desc("median error of the predicted contact, mm (at least 3)")
        .x_labels(16)
        .x_label_formatter(&before_contact)
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let colours = COLOURS.into_iter().chain([BLACK]).cycle();
    for ((s, line), colour) in competitors.into_iter().zip(lines).zip(colours) {
        let points = line.into_iter().map(|(before, error)| (-before, error));
        let learned = s.role == Role::Learned;
        let style = colour.stroke_width(if learned { 4 } else { 2 });
        if s.under_way().intervals.is_some() {
            chart
                .draw_series(LineSeries::new(points, style).point_size(3))
                .map_err(plot_error)?
                .label(s.name.as_str())
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
        } else {
            chart
                .draw_series(DashedLineSeries::new(points, 6, 5, style))
                .map_err(plot_error)?
                .label(s.name.as_str())
                .legend(move |(x, y)| {
                    let dash =
                        |from| PathElement::new(vec![(x + from, y), (x + from + 7, y)], style);
                    EmptyElement::at((0, 0)) + dash(0) + dash(12)
                });
        }
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)?;
    root.present().map_err(plot_error)
}

/// Ticks of a logarithmic axis of errors: 1, 2 and 5 of each decade, or decades alone where these are many.
pub(crate) fn error_ticks(range: &Range<f64>) -> Vec<f64> {
    let (low, high) = (range.start.log10(), range.end.log10());
    let digits: &[f64] = if high - low < 3.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|decade| digits.iter().map(move |digit| digit * 10_f64.powi(decade)))
        .filter(|tick| range.contains(tick))
        .collect()
}

/// Labels of an axis that runs to the contact at 0 and goes on under the legend.
pub(crate) fn before_contact(x: &f64) -> String {
    if *x > 0.5 {
        String::new()
    } else {
        format!("{:.0}", x.abs())
    }
}

/// Observed over stated probability of the regions in space, from 30 to 90 % of the time. Draws nothing
/// and says `false` where nobody states any.
///
/// # Errors
/// A file that cannot be written.
pub fn reliability(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<bool> {
    let lines: Vec<(usize, &str, [f64; REGIONS.len()])> = scores
        .iter()
        .enumerate()
        .filter_map(|(i, s)| Some((i, s.name.as_str(), s.under_way().regions?)))
        .collect();
    if lines.is_empty() {
        return Ok(false);
    }
    let root = SVGBackend::new(path, (620, 600)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, TITLE)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..1.0, 0.0..1.0)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("stated probability of the region")
        .y_desc("share of the contacts in it")
        .x_label_formatter(&|x| format!("{x:.1}"))
        .y_label_formatter(&|y| format!("{y:.1}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let honest = LineSeries::new([(0.0, 0.0), (1.0, 1.0)], BLACK.mix(0.4));
    chart.draw_series(honest).map_err(plot_error)?;
    for (i, name, observed) in lines {
        let style = COLOURS[i % COLOURS.len()].stroke_width(3);
        let points = REGIONS.into_iter().zip(observed).map(|((p, _), o)| (p, o));
        chart
            .draw_series(LineSeries::new(points, style).point_size(3))
            .map_err(plot_error)?
            .label(name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
    }
    legend(&mut chart, SeriesLabelPosition::UpperLeft)?;
    root.present().map_err(plot_error)?;
    Ok(true)
}
