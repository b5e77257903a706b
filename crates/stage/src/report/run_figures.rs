//! The figures of the main job: plan view, and distances over time.

use crate::person::predictors::PredictorKind;
use crate::report::figures::{COLOURS, TEXT, TITLE, legend, plot_error};
use crate::run::judge::RIGHT_M;
use crate::run::trace::Trace;
use glam::DVec3;
use hwall::reachability::WallMaps;
use hwall_scene::{Scene, SurfaceId};
use plotters::prelude::*;
use std::path::Path;

/// Points, colour and name of a line.
type Series<'a> = (&'a [(f64, f64)], RGBColor, &'a str);

/// Samples further apart than this are not joined by a line, s.
const GAP_S: f64 = 0.1;

/// The room from above, with the paths of hand and board.
///
/// # Errors
/// A file that cannot be written.
pub fn plan(path: &Path, scene: &Scene, maps: &WallMaps, trace: &Trace) -> anyhow::Result<()> {
    let points = || {
        let hand = trace.hand_m.iter().map(|p| p.1);
        hand.chain(trace.board_m.iter().map(|p| p.1))
            .chain(trace.touched_m.iter().copied())
    };
    let reach = trace.reach_m;
    let low = points().fold(DVec3::splat(-reach), DVec3::min) - 0.15;
    let high = points().fold(DVec3::splat(reach), DVec3::max) + 0.15;
    let (width, height) = (high.x - low.x, high.y - low.y);
    // The same scale on both axes: the drawing area takes the shape of the room.
    let area = 560.0 / width.max(height);
    let (w, h) = ((width * area) as u32 + 80, (height * area) as u32 + 170);
    let root = SVGBackend::new(path, (w.max(560), h)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let right = (w.max(560) - w) as i32;
    let mut chart = ChartBuilder::on(&root)
        .caption("Plan view: hand, board and predicted contact", TITLE)
        .margin(10)
        .margin_right(10 + right)
        .margin_bottom(76)
        .x_label_area_size(42)
        .y_label_area_size(52)
        .build_cartesian_2d(low.x..high.x, low.y..high.y)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("x, m (arm's base at 0)")
        .y_desc("y, m")
        .x_label_formatter(&|v| tick(*v))
        .y_label_formatter(&|v| tick(*v))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let [blue, orange, green, pink, yellow, sky, grey] = COLOURS;
    // The maps first, below everything else: the more heights are in reach, the darker.
    let stretches = maps.stretches();
    let veil = green.mix(0.04).stroke_width(9);
    let seen = stretches
        .iter()
        .map(|[a, b]| PathElement::new(vec![(a.x, a.y), (b.x, b.y)], veil));
    chart.draw_series(seen).map_err(plot_error)?;
    if !stretches.is_empty() {
        let key = PathElement::new(vec![(f64::NAN, f64::NAN)], veil);
        chart
            .draw_series([key])
            .map_err(plot_error)?
            .label("within reach of the board")
            .legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 18, y)], green.mix(0.5).stroke_width(7))
            });
    }
    for (a, b) in wall_lines(scene)? {
        let line = PathElement::new(vec![(a.x, a.y), (b.x, b.y)], grey.mix(0.75).stroke_width(2));
        chart.draw_series([line]).map_err(plot_error)?;
    }
    let circle = (0..=90).map(|i| f64::from(i) * std::f64::consts::TAU / 90.0);
    let circle: Vec<_> = circle.map(|a| (reach * a.cos(), reach * a.sin())).collect();
    for pair in circle.chunks(2).filter(|p| p.len() == 2) {
        chart
            .draw_series([PathElement::new(pair.to_vec(), grey.mix(0.5))])
            .map_err(plot_error)?;
    }
    chart
        .draw_series([Cross::new((0.0, 0.0), 7, BLACK.stroke_width(3))])
        .map_err(plot_error)?;
    let mut paths =
        |samples: &[(f64, DVec3)], colour: RGBColor, name: &str| -> anyhow::Result<()> {
            let lines = runs(samples).into_iter().map(|run| {
                PathElement::new(
                    run.iter().map(|p| (p.1.x, p.1.y)).collect::<Vec<_>>(),
                    colour.stroke_width(1),
                )
            });
            chart
                .draw_series(lines)
                .map_err(plot_error)?
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2))
                });
            Ok(())
        };
    paths(&trace.hand_m, blue, "hand")?;
    paths(&trace.board_m, orange, "board")?;
    let mut dots =
        |points: &[DVec3], radius: i32, colour: RGBColor, name: &str| -> anyhow::Result<()> {
            chart
                .draw_series(
                    points
                        .iter()
                        .map(|p| Circle::new((p.x, p.y), radius, colour.filled())),
                )
                .map_err(plot_error)?
                .label(name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
            Ok(())
        };
    for (kind, colour) in [(PredictorKind::RayCast, pink), (PredictorKind::Fused, sky)] {
        let points = &trace.predicted_m[kind as usize];
        if !points.is_empty() {
            dots(points, 1, colour, &format!("predicted, {}", kind.name()))?;
        }
    }
    dots(&trace.touched_m, 4, green, "touched")?;
    if !trace.missed_m.is_empty() {
        dots(&trace.missed_m, 4, yellow, "touched, out of reach")?;
    }
    legend(&mut chart, SeriesLabelPosition::LowerLeft)?;
    let note = "grey: walls, shelf and pedestal from above; dashes: longest reach of the arm; cross: its base; hand: index tip";
    root.draw_text(
        note,
        &TextStyle::from(("sans-serif", 13)).color(&BLACK),
        (16, h as i32 - 30),
    )
    .map_err(plot_error)?;
    root.present().map_err(plot_error)
}

/// How far hand and board are from the predicted contact, over time.
///
/// # Errors
/// A file that cannot be written.
pub fn over_time(path: &Path, trace: &Trace, (start_s, end_s): (f64, f64)) -> anyhow::Result<()> {
    let root = SVGBackend::new(path, (980, 840)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let (upper, rest) = root.split_vertically(280);
    let (lower, lowest) = rest.split_vertically(280);
    let [blue, orange, green, pink, yellow, ..] = COLOURS;
    let panel = |area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
                 title: &str,
                 y_desc: &str,
                 scale: f64,
                 top: f64,
                 series: &[Series<'_>]|
     -> anyhow::Result<()> {
        let mut chart = ChartBuilder::on(area)
            .caption(title, TITLE)
            .margin(10)
            .x_label_area_size(40)
            .y_label_area_size(62)
            // Room for the legend beside the lines.
            .build_cartesian_2d(start_s..end_s + 0.3 * (end_s - start_s), 0.0..top)
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .x_desc("time, s")
            .y_desc(y_desc)
            .label_style(TEXT)
            .light_line_style(WHITE)
            .draw()
            .map_err(plot_error)?;
        let mut bands =
            |spans: &[(f64, f64)], colour: RGBColor, name: &str| -> anyhow::Result<()> {
                if spans.is_empty() {
                    return Ok(());
                }
                let boxes = spans
                    .iter()
                    .map(|s| Rectangle::new([(s.0, 0.0), (s.1, top)], colour.mix(0.3).filled()));
                chart
                    .draw_series(boxes)
                    .map_err(plot_error)?
                    .label(name)
                    .legend(move |(x, y)| {
                        Rectangle::new([(x + 2, y - 5), (x + 16, y + 5)], colour.mix(0.3).filled())
                    });
                Ok(())
            };
        bands(&trace.contacts_s, green, "contact felt (above 3 N)")?;
        bands(&trace.lost_s, yellow, "hand lost")?;
        for &(samples, colour, name) in series {
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
            chart
                .draw_series(lines)
                .map_err(plot_error)?
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2))
                });
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    };
    let farthest = trace
        .hand_distance_m
        .iter()
        .fold(0.1, |m: f64, p| m.max(p.1));
    let title = "Hand to the predicted contact";
    panel(
        &upper,
        title,
        "distance, m",
        1.0,
        1.05 * farthest,
        &[(&trace.hand_distance_m, blue, "hand")],
    )?;
    let title = "Board to where it is sent (cut off at 300 mm)";
    panel(
        &lower,
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
    panel(&lowest, &title, "error, mm", 1e3, 300.0, &series)?;
    root.present().map_err(plot_error)
}

/// With one decimal, and zero without a sign.
fn tick(v: f64) -> String {
    let rounded = (10.0 * v).round() / 10.0;
    format!("{:.1}", if rounded == 0.0 { 0.0 } else { rounded })
}

/// Cuts samples where time leaps.
fn runs(samples: &[(f64, DVec3)]) -> Vec<&[(f64, DVec3)]> {
    samples
        .chunk_by(|a, b| b.0 - a.0 <= GAP_S)
        .filter(|run| run.len() > 1)
        .collect()
}

/// Vertical faces seen from above: their longest horizontal edge.
fn wall_lines(scene: &Scene) -> anyhow::Result<Vec<(DVec3, DVec3)>> {
    let mut lines = Vec::new();
    for id in (0..scene.surfaces().len()).map(SurfaceId) {
        for [a, b, c] in scene.triangles_m(id)? {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.z.abs() < 0.02 {
                let flat = |p: DVec3, q: DVec3| (p - q).truncate().length_squared();
                let pairs = [(a, b), (b, c), (c, a)];
                lines.extend(
                    pairs
                        .into_iter()
                        .max_by(|x, y| flat(x.0, x.1).total_cmp(&flat(y.0, y.1))),
                );
            }
        }
    }
    Ok(lines)
}
