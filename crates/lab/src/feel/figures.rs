//! A push over time.

use super::push::{Sample, Trace};
use super::subject::Subject;
use hwall_haptics::ObjectPath;
use hwall_stage::figures::{COLOURS, Sign, legend_beside, width_of};
use hwall_stage::report::figure::{Axes, Plot, figure};
use plotters::prelude::*;
use std::path::Path;

/// Widths of the axes and of the legend beside them, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 190;

/// Force, position and energy over time, for all control modes and the ideal object.
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
