//! What was wanted beside what was rendered.

use crate::report::figure::{Axes, Draw, Mesh, Plot, figure};
use hwall_stage::figures::COLOURS;
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
    let panels = [
        (angles, ["wanted angle, degrees", "off by, degrees"], 95.0),
        (speeds, ["wanted speed, mm/s", "off by, mm/s"], 105.0),
    ];
    figure(path, (900, 420), |root| {
        let areas = root.below("Rendered less wanted, each trial that counts")?;
        let areas = areas.split_evenly((1, 2));
        for ((points, names, most), area) in panels.into_iter().zip(areas) {
            let most = points.iter().map(|p| 1.05 * p.0).fold(most, f64::max);
            let largest = points.iter().map(|p| p.1.abs()).fold(0.1, f64::max);
            let axes = Axes {
                names,
                numbers: [Some(6), None],
                labels: [64, 46],
                margin: 12,
                mesh: Mesh::Single,
                ..Axes::default()
            };
            let mut chart = axes.on(&area, -5.0..most, -1.15 * largest..1.15 * largest)?;
            let dots = points
                .iter()
                .map(|at| Circle::new(*at, 3, COLOURS[0].mix(0.5).filled()));
            chart.series(dots)?;
        }
        Ok(())
    })
}
