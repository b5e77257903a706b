//! A push over time, errors of what is felt, lightest stable masses.

use super::push::{Sample, Trace};
use super::rig::Way;
use super::stability::Bound;
use super::study::Row;
use super::subject::Subject;
use crate::report::figure::{Axes, Mesh, Plot, figure, named_line, whole};
use hwall_haptics::ObjectPath;
use hwall_stage::figures::{COLOURS, Sign, TEXT, legend, legend_beside, width_of};
use plotters::prelude::*;
use std::path::Path;

/// Width of the axes, and of the legend beside them, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 190;
/// Size of the other figures, pixels.
const SIZE: (u32, u32) = (900, 480);

/// Force, position and energy over time, all ways beside the ideal object.
///
/// # Errors
/// A file that cannot be written.
pub fn push(path: &Path, subject: &Subject, lines: &[(String, Trace)]) -> anyhow::Result<()> {
    let (scale, unit) = match subject.object.path {
        ObjectPath::Turning { .. } => (180.0 / std::f64::consts::PI, "opening, degrees"),
        ObjectPath::Sliding { .. } => (1e3, "opening, mm"),
    };
    type Value<'a> = &'a dyn Fn(&Sample) -> f64;
    let rows: [(&str, &str, Value<'_>, Option<Value<'_>>); 3] = [
        ("Force of the hand", "force, N", &|s| s.force_n, None),
        (
            "Opening: rendered, and that of the ideal object under the same force",
            unit,
            &|s| scale * s.position,
            Some(&|s| scale * s.ideal),
        ),
        (
            "Energy given to the board, less what came back",
            "energy, J",
            &|s| s.given_j,
            Some(&|s| s.ideal_given_j),
        ),
    ];
    let samples = || lines.iter().flat_map(|(_, trace)| &trace.samples);
    let most_s = samples().map(|s| s.t_s).fold(0.0, f64::max);
    figure(path, (WIDTH + BESIDE, 1000), |root| {
        for (area, (title, unit, value, ideal)) in root.split_evenly((3, 1)).iter().zip(rows) {
            let all = || samples().flat_map(|s| [Some(value(s)), ideal.map(|f| f(s))]);
            let (low, high) = all()
                .flatten()
                .fold((0.0, 1e-6), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
            let room = 0.08 * (high - low);
            let axes = Axes {
                title,
                names: ["time, s", unit],
                labels: [70, 46],
                margin: 12,
                beside: BESIDE,
                ..Axes::default()
            };
            let mut chart = axes.on(area, 0.0..most_s, low - room..high + room)?;
            let mut keys = Vec::new();
            for (place, ((name, trace), colour)) in (0..).zip(lines.iter().zip(COLOURS)) {
                let line = trace.samples.iter().step_by(5).map(|s| (s.t_s, value(s)));
                let width = width_of(place, lines.len());
                chart.line(line, colour.stroke_width(width))?;
                keys.push((Sign::Line(width), colour, name.as_str()));
            }
            if let (Some(ideal), Some((_, trace))) = (ideal, lines.first()) {
                let shown = trace.samples.iter().step_by(60);
                chart.series(
                    shown.map(|s| Circle::new((s.t_s, ideal(s)), 3, BLACK.stroke_width(1))),
                )?;
                keys.push((Sign::Ring, BLACK, "ideal object"));
            }
            legend_beside(area, (WIDTH as i32, 50), keys)?;
        }
        Ok(())
    })
}

/// Errors of stiffness, inertia and damping, one column each, a dot for each object.
///
/// # Errors
/// A file that cannot be written.
pub fn errors(path: &Path, rows: &[Row]) -> anyhow::Result<()> {
    const MOST: f64 = 20.0;
    const COLUMNS: [(&str, f64); 3] = [
        ("stiffness (target 2 %)", 2.0),
        ("inertia (target 5 %)", 5.0),
        ("damping (target 5 %)", 5.0),
    ];
    figure(path, SIZE, |root| {
        let axes = Axes {
            title: "What is felt against what was asked for",
            names: ["", "error, %"],
            numbers: [Some(0), None],
            labels: [70, 46],
            margin: 12,
            mesh: Mesh::Across,
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..3.0, -MOST..MOST)?;
        let columns = || (0..).map(f64::from).zip(COLUMNS);
        let bands = columns().map(|(column, (_, target))| {
            let corners = [(column + 0.05, -target), (column + 0.95, target)];
            Rectangle::new(corners, BLACK.mix(0.08).filled())
        });
        chart.series(bands)?;
        let names = columns()
            .map(|(column, (name, _))| Text::new(name, (column + 0.28, 0.93 * MOST), TEXT));
        chart.series(names)?;
        for ((k, way), colour) in (0..).map(f64::from).zip(Way::ALL).zip(COLOURS) {
            let own: Vec<&Row> = rows.iter().filter(|row| row.way == way).collect();
            let dots = own.iter().enumerate().flat_map(|(i, row)| {
                let at = 0.1 + 0.27 * k + 0.22 * i as f64 / own.len() as f64;
                let errors = row.errors().into_iter().enumerate();
                errors.filter_map(move |(column, error)| {
                    let error = (100.0 * error?).clamp(-MOST, MOST);
                    let place = (column as f64 + at, error);
                    Some(Circle::new(place, 4, colour.filled()))
                })
            });
            chart
                .series(dots)?
                .label(way.name())
                .legend(move |(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
        }
        legend(&mut chart, SeriesLabelPosition::LowerLeft)
    })
}

/// Lightest stable mass over the stiffness of the hand, both logarithmic.
///
/// # Errors
/// A file that cannot be written.
pub fn bounds(path: &Path, bounds: &[Bound]) -> anyhow::Result<()> {
    figure(path, SIZE, |root| {
        let axes = Axes {
            title: "Lightest stable panel: found (dots), (k + 1000 N/m) t² (lines)",
            names: ["stiffness of the hand, N/m", "mass, kg"],
            formats: [Some(&whole), Some(&f64::to_string)],
            labels: [70, 46],
            margin: 12,
            ..Axes::default()
        };
        let [x, y] = [150.0..4000.0, 0.02..10.0].map(IntoLogRange::log_scale);
        let mut chart = axes.on(
            root,
            x.with_key_points(vec![200.0, 500.0, 1000.0, 2000.0, 3000.0]),
            y.with_key_points(vec![0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]),
        )?;
        for (way, colour) in Way::ALL.into_iter().zip(COLOURS) {
            let own = || bounds.iter().filter(|b| b.way == way);
            let line = own().map(|b| {
                let k = b.stiffness_n_per_m;
                (k, (k + 1000.0) * b.mass_kg / (b.share * k))
            });
            let style = colour.stroke_width(2);
            named_line(chart.line(line, style)?, way.name(), style);
            let dots = own().map(|b| (b.stiffness_n_per_m, b.mass_kg));
            chart.series(dots.map(|at| Circle::new(at, 4, colour.filled())))?;
        }
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}
