//! What was wanted beside what was rendered.

use hwall_stage::figures::{COLOURS, TEXT, TITLE, plot_error};
use hwall_stage::report::figure_file::FigureFile;
use hwall_study::{TrialKind, TrialRecord};
use plotters::prelude::*;
use std::path::Path;

/// Angle and speed of every trial that counts: rendered less wanted, over wanted. Practice and catch trials do not.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn rendered(path: &Path, records: &[TrialRecord]) -> anyhow::Result<()> {
    let counts = |r: &&TrialRecord| r.is_valid() && r.trial.kind == TrialKind::Main;
    let valid = || records.iter().filter(counts);
    let angles: Vec<(f64, f64)> = valid()
        .filter_map(|r| {
            let is = r.shown.rendered.angle_deg?;
            Some((r.wanted.angle_deg, is - r.wanted.angle_deg))
        })
        .collect();
    let speeds: Vec<(f64, f64)> = valid()
        .filter_map(|r| {
            let is = r.shown.rendered.speed_mm_per_s?;
            Some((r.wanted.speed_mm_per_s, is - r.wanted.speed_mm_per_s))
        })
        .collect();
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (900, 420)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let root = root
        .titled("Rendered less wanted, each trial that counts", TITLE)
        .map_err(plot_error)?;
    let panels = [
        (angles, "wanted angle, degrees", "off by, degrees", 95.0),
        (speeds, "wanted speed, mm/s", "off by, mm/s", 105.0),
    ];
    for ((points, x, y, most), area) in panels.into_iter().zip(root.split_evenly((1, 2))) {
        let most = points.iter().map(|p| 1.05 * p.0).fold(most, f64::max);
        let largest = points.iter().map(|p| p.1.abs()).fold(0.1, f64::max);
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(-5.0..most, -1.15 * largest..1.15 * largest)
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .x_desc(x)
            .y_desc(y)
            .label_style(TEXT)
            .max_light_lines(0)
            .x_labels(6)
            .draw()
            .map_err(plot_error)?;
        let dots = points
            .iter()
            .map(|at| Circle::new(*at, 3, COLOURS[0].mix(0.5).filled()));
        chart.draw_series(dots).map_err(plot_error)?;
    }
    root.present().map_err(plot_error)?;
    drop(root);
    file.finish()
}
