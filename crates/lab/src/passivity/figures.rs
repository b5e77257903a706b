//! Stiffness against damping, and the energy that contacts generate.

use super::study::Row;
use super::z_width::{Point, SAMPLINGS};
use crate::report::figure::{Axes, Mesh, Plot, figure, named_line};
use hwall_haptics::passivity::Causality;
use hwall_stage::figures::{COLOURS, Sign, legend, legend_beside, width_of};
use plotters::prelude::*;
use std::path::Path;

/// Simulated (dots) and by the formula (lines), both axes logarithmic.
///
/// # Errors
/// A file that cannot be written.
pub fn z_width(path: &Path, points: &[Point]) -> anyhow::Result<()> {
    figure(path, (900, 560), |root| {
        let axes = Axes {
            title: "Largest stiffness: simulated (dots), K = b / (T/2 + t_d) (lines)",
            names: ["physical damping, N s/m", "stiffness, N/m"],
            formats: [None, Some(&|y| format!("{y:.0e}"))],
            labels: [84, 52],
            mesh: Mesh::All,
            ..Axes::default()
        };
        let mut chart = axes.on(root, (0.15..150.0).log_scale(), (5.0..1e6).log_scale())?;
        for (sampling, colour) in SAMPLINGS.iter().zip(COLOURS) {
            let own = || points.iter().filter(|point| point.sampling == *sampling);
            let line = own().map(|p| (p.damping_n_s_per_m, p.theory_n_per_m));
            let name = format!(
                "T = {} ms, t_d = {} ms",
                1e3 * sampling.period_s,
                1e3 * sampling.delay_s
            );
            let style = colour.stroke_width(2);
            named_line(chart.line(line, style)?, name, style);
            let dots = own().map(|p| (p.damping_n_s_per_m, p.simulated_n_per_m));
            chart.series(dots.map(|at| Circle::new(at, 4, colour.filled())))?;
        }
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
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
    figure(path, (WIDTH + BESIDE, 760), |root| {
        let causalities = [Causality::Impedance, Causality::Admittance];
        for (area, causality) in root.split_evenly((2, 1)).iter().zip(causalities) {
            let axes = Axes {
                title: &format!("Energy generated in a contact: {causality:?}"),
                names: ["energy, J", "contacts with no more, %"],
                formats: [Some(&|x| format!("{x:.0e}")), None],
                labels: [70, 52],
                beside: BESIDE,
                mesh: Mesh::All,
                ..Axes::default()
            };
            let mut chart = axes.on(area, (LEAST_J..MOST_J).log_scale(), 0.0..103.0)?;
            let own: Vec<&Row> = rows
                .iter()
                .filter(|row| row.causality == causality)
                .collect();
            let mut keys = Vec::new();
            for (place, (row, colour)) in (0..).zip(own.iter().zip(COLOURS)) {
                let width = width_of(place, own.len());
                let quantiles = &row.generated_quantiles_j;
                let line = quantiles
                    .iter()
                    .map(|(share, j)| (j.max(LEAST_J), 100.0 * share));
                // To the right edge: who never generates more has all contacts there, too.
                let most_j = quantiles.last().map(|last| last.1);
                let rest = most_j.map(|most_j| (MOST_J.max(most_j), 100.0));
                chart.line(line.chain(rest), colour.stroke_width(width))?;
                keys.push((Sign::Line(width), colour, row.method.name()));
            }
            legend_beside(area, (WIDTH as i32, 50), keys)?;
        }
        Ok(())
    })
}
