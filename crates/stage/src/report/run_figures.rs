//! The figure of the main job over time: distances of hand, board and predictions.

use crate::person::predictors::PredictorKind;
use crate::report::figure::{Area, Axes, Plot, figure};
use crate::report::figures::{COLOURS, Sign, legend_beside};
use crate::run::evaluation::judge::RIGHT_M;
use crate::run::logs::push_log::ForceSample;
use crate::run::logs::trace::Trace;
use glam::DVec3;
use plotters::prelude::*;
use std::path::Path;

/// Points, colour and name of a line.
type Series<'a> = (&'a [(f64, f64)], RGBColor, &'a str);

/// Samples further apart than this are not joined by a line, s.
const GAP_S: f64 = 0.1;

/// Sizes of the figure, its panels and the legend, pixels.
const WIDTH: u32 = 1100;
const PANEL: u32 = 280;
const MARGIN: u32 = 10;
const LABELS: u32 = 62;
const LEGEND: u32 = 240;

/// A tick: as many digits as it needs.
fn short(value: &f64) -> String {
    format!("{}", (value * 1e3).round() / 1e3)
}

/// Distances of hand and board from the predicted contact, and force and opening of a pushed object, over time.
///
/// # Errors
/// A file that cannot be written.
pub fn over_time(
    path: &Path,
    trace: &Trace,
    forces: &[ForceSample],
    (start_s, end_s): (f64, f64),
) -> anyhow::Result<()> {
    figure(path, (WIDTH, 4 * PANEL), |root| {
        let panels = root.split_evenly((4, 1));
        let [upper, lower, lowest, pushed] = &panels[..] else {
            return Ok(());
        };
        let [blue, orange, green, pink, yellow, ..] = COLOURS;
        let panel = |area: &Area<'_>,
                     title: &str,
                     y_desc: &str,
                     scale: f64,
                     top: f64,
                     series: &[Series<'_>]|
         -> anyhow::Result<()> {
            let axes = Axes {
                title,
                names: ["time, s", y_desc],
                formats: [Some(&short), Some(&short)],
                labels: [LABELS, 40],
                margin: MARGIN,
                beside: LEGEND - MARGIN,
                ..Axes::default()
            };
            let mut chart = axes.on(area, start_s..end_s, 0.0..top)?;
            let mut bands = |spans: &[(f64, f64)], colour: RGBColor| -> anyhow::Result<()> {
                if spans.is_empty() {
                    return Ok(());
                }
                let boxes = spans
                    .iter()
                    .map(|s| Rectangle::new([(s.0, 0.0), (s.1, top)], colour.mix(0.3).filled()));
                chart.series(boxes)?;
                Ok(())
            };
            bands(&trace.contacts_s, green)?;
            bands(&trace.lost_s, yellow)?;
            for &(samples, colour, _) in series {
                let timed: Vec<(f64, DVec3)> = samples
                    .iter()
                    .map(|&(t, d)| (t, DVec3::new((d * scale).min(top), 0.0, 0.0)))
                    .collect();
                let lines = runs(&timed).into_iter().map(|run| {
                    PathElement::new(
                        run.iter().map(|p| (p.0, p.1.x)).collect::<Vec<_>>(),
                        colour.stroke_width(2),
                    )
                });
                chart.series(lines)?;
            }
            // Legend beside the axes, not over the lines.
            let spans = [
                (&trace.contacts_s, green, "contact felt (above 3 N)"),
                (&trace.lost_s, yellow, "hand lost"),
            ];
            let spans = spans.into_iter().filter(|(spans, ..)| !spans.is_empty());
            let keys = spans.map(|(_, colour, name)| (Sign::Line(10), colour.mix(0.3), name));
            let lines = series.iter();
            let lines = lines.map(|&(_, colour, name)| (Sign::Line(2), colour.to_rgba(), name));
            let beside = ((WIDTH - LEGEND) as i32 + 12, 48);
            legend_beside(area, beside, keys.chain(lines))
        };
        let farthest = trace
            .hand_distance_m
            .iter()
            .fold(0.1, |m: f64, p| m.max(p.1));
        let title = "Hand to the predicted contact";
        panel(
            upper,
            title,
            "distance, m",
            1.0,
            1.05 * farthest,
            &[(&trace.hand_distance_m, blue, "hand")],
        )?;
        let title = "Board to where it is sent (cut off at 300 mm)";
        panel(
            lower,
            title,
            "error, mm",
            1e3,
            300.0,
            &[(&trace.board_distance_m, orange, "board")],
        )?;
        let title = format!(
            "Predictions to the next touch, until contact (cut off at 300 mm; right: below {:.0} mm)",
            1e3 * RIGHT_M
        );
        let of =
            |kind: PredictorKind, colour| (&trace.errors_m[kind as usize][..], colour, kind.name());
        let series = [
            of(PredictorKind::RayCast, pink),
            of(PredictorKind::RayLed, orange),
            of(PredictorKind::Fused, blue),
        ];
        panel(lowest, &title, "error, mm", 1e3, 300.0, &series)?;
        let title = "Force of the hand on the board, and how far what it pushed last is open";
        let force: Vec<(f64, f64)> = forces.iter().map(|s| (s.t_s, s.force_n)).collect();
        let opening: Vec<(f64, f64)> = forces.iter().map(|s| (s.t_s, s.opening.abs())).collect();
        let most = force
            .iter()
            .chain(&opening)
            .fold(1.0, |m: f64, p| m.max(p.1));
        let series = [
            (&force[..], blue, "force, N"),
            (&opening[..], orange, "opening, degrees or mm"),
        ];
        panel(pushed, title, "N; degrees or mm", 1.0, 1.1 * most, &series)
    })
}

/// Splits samples at gaps in time.
pub(super) fn runs(samples: &[(f64, DVec3)]) -> Vec<&[(f64, DVec3)]> {
    samples
        .chunk_by(|a, b| b.0 - a.0 <= GAP_S)
        .filter(|run| run.len() > 1)
        .collect()
}
