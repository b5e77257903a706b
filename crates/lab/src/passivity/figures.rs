//! Stiffness against damping, and the energy that contacts generate.

use super::study::Row;
use super::z_width::{Point, SAMPLINGS};
use hwall_haptics::passivity::Causality;
use hwall_stage::figures::{
    COLOURS, Sign, TEXT, TITLE, legend, legend_beside, plot_error, width_of,
};
use hwall_stage::report::figure_file::FigureFile;
use plotters::prelude::*;
use std::path::Path;

/// Simulated (dots) and by the formula (lines), both axes logarithmic.
///
/// # Errors
/// A file that cannot be written.
pub fn z_width(path: &Path, points: &[Point]) -> anyhow::Result<()> {
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (900, 560)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(
            "Largest stiffness: simulated (dots), K = b / (T/2 + t_d) (lines)",
            TITLE,
        )
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(84)
        .build_cartesian_2d((0.15..150.0).log_scale(), (5.0..1e6).log_scale())
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("physical damping, N s/m")
        .y_desc("stiffness, N/m")
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .label_style(TEXT)
        .draw()
        .map_err(plot_error)?;
    for (sampling, colour) in SAMPLINGS.iter().zip(COLOURS) {
        let own = || points.iter().filter(|point| point.sampling == *sampling);
        let line = own().map(|p| (p.damping_n_s_per_m, p.theory_n_per_m));
        let name = format!(
            "T = {} ms, t_d = {} ms",
            1e3 * sampling.period_s,
            1e3 * sampling.delay_s
        );
        chart
            .draw_series(LineSeries::new(line, colour.stroke_width(2)))
            .map_err(plot_error)?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
        let dots = own().map(|p| {
            Circle::new(
                (p.damping_n_s_per_m, p.simulated_n_per_m),
                4,
                colour.filled(),
            )
        });
        chart.draw_series(dots).map_err(plot_error)?;
    }
    legend(&mut chart, SeriesLabelPosition::UpperLeft)?;
    root.present().map_err(plot_error)?;
    file.finish()
}

/// Energies at or below this are drawn at it, J: a logarithmic axis has no zero.
const LEAST_J: f64 = 1e-10;
/// The right end of the axis, J.
const MOST_J: f64 = 1e3;
/// Width of the axes, and of the legend beside them, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 220;

/// How many contacts generate more than an energy, one panel a causality.
///
/// # Errors
/// A file that cannot be written.
pub fn generated(path: &Path, rows: &[Row]) -> anyhow::Result<()> {
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (WIDTH + BESIDE, 760)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    for (area, causality) in root
        .split_evenly((2, 1))
        .iter()
        .zip([Causality::Impedance, Causality::Admittance])
    {
        let mut chart = ChartBuilder::on(area)
            .caption(
                format!("Energy generated in a contact: {causality:?}"),
                TITLE,
            )
            .margin(14)
            .margin_right(14 + BESIDE)
            .x_label_area_size(52)
            .y_label_area_size(70)
            .build_cartesian_2d((LEAST_J..MOST_J).log_scale(), 0.0..103.0)
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .x_desc("energy, J")
            .y_desc("contacts with no more, %")
            .x_label_formatter(&|x| format!("{x:.0e}"))
            .label_style(TEXT)
            .draw()
            .map_err(plot_error)?;
        let own: Vec<&Row> = rows
            .iter()
            .filter(|row| row.causality == causality)
            .collect();
        let mut keys = Vec::new();
        for (place, (row, colour)) in (0..).zip(own.iter().zip(COLOURS)) {
            let width = width_of(place, own.len());
            let line = row
                .generated_quantiles_j
                .iter()
                .map(|(share, energy_j)| (energy_j.max(LEAST_J), 100.0 * share));
            // To the right edge: who never generates more has all contacts there, too.
            let most_j = row.generated_quantiles_j.last().map(|last| last.1);
            let rest = most_j.map(|most_j| (MOST_J.max(most_j), 100.0));
            let line = line.chain(rest);
            chart
                .draw_series(LineSeries::new(line, colour.stroke_width(width)))
                .map_err(plot_error)?;
            keys.push((Sign::Line(width), colour, row.method.name()));
        }
        legend_beside(area, (WIDTH as i32, 50), keys)?;
    }
    root.present().map_err(plot_error)?;
    file.finish()
}
