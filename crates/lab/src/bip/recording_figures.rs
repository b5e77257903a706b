//! Error of the predicted end over the share of the motion that was seen.

use crate::bip::study::{FRACTIONS, Report, Row, Study};
use anyhow::Context;
use hwall_stage::figures::{COLOURS, TEXT, TITLE, legend, plot_error};
use plotters::prelude::*;
use std::path::{Path, PathBuf};

/// Errors below this are drawn at it, mm: a logarithmic axis has no zero.
const SMALLEST_MM: f64 = 3.0;

impl Report {
    /// One SVG a source of reaches, `bip_NAME.svg`, into a folder, which is made if need be.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn draw(&self, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let one = |study: &Study| {
            let path = folder.join(format!("bip_{}.svg", study.reaches.name));
            end_error(&path, study).map(|()| path)
        };
        self.studies.iter().map(one).collect()
    }
}

/// Median error of every predictor; those that state their uncertainty have full lines.
///
/// # Errors
/// A file that cannot be written.
pub fn end_error(path: &Path, study: &Study) -> anyhow::Result<()> {
    let largest = study
        .rows
        .iter()
        .flat_map(|row| FRACTIONS.map(|f| row.median_mm(f)))
        .fold(100.0, f64::max);
    let root = SVGBackend::new(path, (900, 560)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let title = format!(
        "{}: end of {} reaches, each held out",
        study.reaches.name,
        study.reaches.demonstrations.len()
    );
    // Room on the right for the legend.
    let mut chart = ChartBuilder::on(&root)
        .caption(title, TITLE)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(70)
        .build_cartesian_2d(10.0..165.0, (0.9 * SMALLEST_MM..1.2 * largest).log_scale())
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("share of the motion seen, %")
        .y_desc("median error of the predicted end, mm (at least 3)")
        .x_labels(16)
        .x_label_formatter(&|x| {
            if *x > 100.5 {
                String::new()
            } else {
                format!("{x:.0}")
            }
        })
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let (models, simple): (Vec<&Row>, Vec<&Row>) = study
        .rows
        .iter()
        .partition(|row| row.calibration().is_some());
    let points = |row: &Row| {
        FRACTIONS
            .map(|f| (100.0 * f, row.median_mm(f).max(SMALLEST_MM)))
            .to_vec()
    };
    for (row, colour) in simple.into_iter().zip(COLOURS.into_iter().rev()) {
        let style = colour.stroke_width(2);
        chart
            .draw_series(DashedLineSeries::new(points(row), 5, 5, style))
            .map_err(plot_error)?
            .label(row.name.as_str())
            .legend(move |(x, y)| {
                let dash = |from| PathElement::new(vec![(x + from, y), (x + from + 6, y)], style);
                EmptyElement::at((0, 0)) + dash(0) + dash(12)
            });
    }
    for (row, colour) in models.into_iter().zip(COLOURS) {
        let style = colour.stroke_width(3);
        chart
            .draw_series(LineSeries::new(points(row), style).point_size(3))
            .map_err(plot_error)?
            .label(row.name.as_str())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)?;
    root.present().map_err(plot_error)
}
