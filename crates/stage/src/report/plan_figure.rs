//! The room from above: walls, arm, board, hand and touches.

use crate::person::predictors::PredictorKind;
use crate::report::figure::{self, Axes, Draw, Mesh, Plot, figure};
use crate::report::figures::{COLOURS, TITLE};
use crate::report::legend::{Legend, Pixel};
use crate::report::run_figures::runs;
use crate::run::logs::snapshots::BoardFace;
use crate::run::logs::trace::{TouchMark, Trace};
use glam::{DVec2, DVec3};
use hwall::reachability::WallMaps;
use hwall_scene::{Scene, SurfaceId};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::path::Path;

/// Longer side of the drawing, pixels.
const SIDE_PX: f64 = 620.0;
/// Width and height of the legend beside it, pixels.
const LEGEND_PX: [u32; 2] = [340, 560];
/// Room for the labels of the axes, the title and the rim, pixels.
const LABELS_PX: [u32; 2] = [46, 54];
const TITLE_PX: u32 = 44;
const RIM_PX: u32 = 10;
/// The shorter side is at least this share of the longer one.
const LEAST_ASPECT: f64 = 0.75;
/// Least extent shown around the base, m.
const BASE_M: f64 = 0.28;
/// Margin around everything, m.
const MARGIN_M: f64 = 0.12;
/// Length of a normal, m.
const NORMAL_M: f64 = 0.07;

type Chart<'a, 'p> = figure::Chart<'a, 'p, RangedCoordf64, RangedCoordf64>;

/// Opacity of the arm at successive instants.
const ARM_SHADES: [f64; 3] = [0.25, 0.5, 1.0];

/// Opacity of the boards at contacts.
const MET_SHADE: f64 = 0.5;

/// The room from above, with the paths of hand and board, the arm during one touch, and the outcome of each touch.
///
/// # Errors
/// A file that cannot be written.
pub fn plan(path: &Path, scene: &Scene, maps: &WallMaps, trace: &Trace) -> anyhow::Result<()> {
    let [low, high] = extent(trace);
    let size = high - low;
    // The same scale on both axes: the drawing has the aspect ratio of its content.
    let scale = SIDE_PX / size.x.max(size.y);
    let [w, h] = [
        (size.x * scale).round() as u32 + LABELS_PX[1] + 2 * RIM_PX,
        (size.y * scale).round() as u32 + LABELS_PX[0] + TITLE_PX + RIM_PX,
    ];
    let all_h = h.max(LEGEND_PX[1]);
    figure(path, (w + LEGEND_PX[0], all_h), |root| {
        // The legend may be the taller of the two.
        let left = root.clone().shrink((0, 0), (w, h));
        let axes = Axes {
            names: ["x, m (arm's base at 0)", "y, m"],
            formats: [Some(&tick), Some(&tick)],
            numbers: [Some(8), Some(10)],
            labels: [LABELS_PX[1], LABELS_PX[0]],
            margin: RIM_PX,
            above: TITLE_PX - RIM_PX,
            mesh: Mesh::Faint,
            ..Axes::default()
        };
        let chart = axes.on(&left, low.x..high.x, low.y..high.y)?;
        let title = "Plan view: where hand, arm and board were";
        let at = ((LABELS_PX[1] + RIM_PX) as i32, RIM_PX as i32);
        root.write(title, TextStyle::from(TITLE).color(&BLACK), at)?;
        let mut drawing = Drawing {
            chart,
            low,
            high,
            legend: Legend {
                area: root.clone(),
                x: w as i32 + 8,
                y: 48,
            },
        };
        drawing.room(scene, maps, trace.reach_m)?;
        drawing.paths(trace)?;
        drawing.arm(trace)?;
        drawing.touches(trace)
    })
}

/// Bounds of everything drawn, with a margin.
fn extent(trace: &Trace) -> [DVec2; 2] {
    let hand = trace.hand_m.iter().map(|p| p.1);
    let arms = trace.arms.iter();
    let points = hand
        .chain(trace.board_m.iter().map(|p| p.1))
        .chain(trace.touched_m.iter().map(|p| p.0))
        .chain(arms.flat_map(|arm| arm.skeleton_m.iter().copied()))
        .chain(trace.boards.iter().flat_map(|board| board.corners_m))
        .map(DVec3::truncate);
    let base = DVec2::splat(BASE_M);
    let (low, high) = points.fold((-base, base), |(low, high), p| (low.min(p), high.max(p)));
    let (low, high) = (low - MARGIN_M, high + MARGIN_M);
    let size = high - low;
    let pad = 0.5 * (DVec2::splat(LEAST_ASPECT * size.max_element()) - size).max(DVec2::ZERO);
    [low - pad, high + pad]
}

/// The drawing and its legend, which grow together.
struct Drawing<'a, 'p> {
    chart: Chart<'a, 'p>,
    /// Bounds, m.
    low: DVec2,
    high: DVec2,
    legend: Legend<'p>,
}

impl Drawing<'_, '_> {
    fn line(&mut self, points: Vec<(f64, f64)>, style: ShapeStyle) -> anyhow::Result<()> {
        self.chart.series([PathElement::new(points, style)])?;
        Ok(())
    }

    /// A straight line clipped to the picture; the chart itself would distort it at its border.
    fn clipped(&mut self, from: DVec2, to: DVec2, style: ShapeStyle) -> anyhow::Result<()> {
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for i in 0..2 {
            let way = to[i] - from[i];
            let at = [self.low[i], self.high[i]].map(|border| (border - from[i]) / way);
            if way == 0.0 {
                if !(self.low[i]..=self.high[i]).contains(&from[i]) {
                    return Ok(());
                }
                continue;
            }
            first = first.max(at[0].min(at[1]));
            last = last.min(at[0].max(at[1]));
        }
        if first >= last {
            return Ok(());
        }
        let ends = [first, last].map(|share| from.lerp(to, share));
        self.line(ends.map(|p| (p.x, p.y)).to_vec(), style)
    }

    fn is_shown(&self, at: DVec2) -> bool {
        at.cmpge(self.low).all() && at.cmple(self.high).all()
    }

    /// The pixel of a point of the room.
    fn pixel(&self, at: (f64, f64)) -> Pixel {
        self.chart.plotting_area().map_coordinate(&at)
    }

    /// The static parts.
    fn room(&mut self, scene: &Scene, maps: &WallMaps, reach_m: f64) -> anyhow::Result<()> {
        let [_, _, green, _, _, _, grey] = COLOURS;
        // Drawn first: darker where more heights are in reach.
        let stretches = maps.stretches();
        let veil = green.mix(0.035).stroke_width(11);
        for [a, b] in &stretches {
            self.clipped(a.truncate(), b.truncate(), veil)?;
        }
        let wall = grey.mix(0.75).stroke_width(2);
        for (a, b) in wall_lines(scene)? {
            self.clipped(a.truncate(), b.truncate(), wall)?;
        }
        self.legend.heading("Room")?;
        self.legend.line(wall, "walls and furniture")?;
        if !stretches.is_empty() {
            let shown = green.mix(0.4).stroke_width(9);
            self.legend.line(shown, "within reach of the board")?;
        }
        let circle = (0..=180).map(|i| f64::from(i) * std::f64::consts::TAU / 180.0);
        let circle: Vec<_> = circle.map(|a| reach_m * DVec2::from_angle(a)).collect();
        let dash = grey.mix(0.5).stroke_width(1);
        for pair in circle.chunks(2).filter(|p| p.len() == 2) {
            self.clipped(pair[0], pair[1], dash)?;
        }
        self.legend.dashes(dash, "longest reach of the arm")
    }

    fn paths(&mut self, trace: &Trace) -> anyhow::Result<()> {
        let [blue, orange, _, _, _, sky, _] = COLOURS;
        self.legend.heading("Over the whole run")?;
        for (samples, colour, name) in [
            (&trace.board_m, orange.mix(0.35), "middle of the board"),
            (&trace.hand_m, blue.mix(0.8), "tip of the index finger"),
        ] {
            for run in runs(samples) {
                let points = run.iter().map(|p| (p.1.x, p.1.y)).collect();
                self.line(points, colour.stroke_width(1))?;
            }
            self.legend.line(colour.stroke_width(2), name)?;
        }
        let shown = |kind: &PredictorKind| !trace.predicted_m[*kind as usize].is_empty();
        if let Some(kind) = PredictorKind::ALL.into_iter().find(shown) {
            let predicted = &trace.predicted_m[kind as usize];
            let dots = predicted
                .iter()
                .filter(|p| self.is_shown(p.truncate()))
                .map(|p| Circle::new((p.x, p.y), 1, sky.filled()))
                .collect::<Vec<_>>();
            self.chart.series(dots)?;
            let name = format!("predicted contacts, {}", kind.name());
            self.legend.dots(sky.filled(), &name)?;
        }
        Ok(())
    }

    /// The arm at a few instants, with its board to scale.
    fn arm(&mut self, trace: &Trace) -> anyhow::Result<()> {
        let [_, orange, ..] = COLOURS;
        // Drawn below the arm, whose board must stand out.
        for board in &trace.boards {
            self.board(board, orange.mix(MET_SHADE), 2)?;
        }
        self.legend.heading("The arm on its way to one touch")?;
        if trace.arms.is_empty() {
            self.legend.text("(nothing within reach was touched)")?;
        }
        for (arm, shade) in trace.arms.iter().zip(ARM_SHADES) {
            let (link, joint) = (BLACK.mix(shade), BLACK.mix(shade));
            let face = orange.mix(0.25 + 0.75 * shade);
            let points: Vec<_> = arm.skeleton_m.iter().map(|p| (p.x, p.y)).collect();
            let joints: Vec<Pixel> = points[..points.len() - 1]
                .iter()
                .map(|at| self.pixel(*at))
                .collect();
            self.line(points, link.stroke_width(3))?;
            for at in joints {
                self.legend.ring(at, joint)?;
            }
            self.board(&arm.board, face, 5)?;
            self.legend.linkage(link, face, arm.what)?;
        }
        let at = self.pixel((0.0, 0.0));
        self.legend.cross(at, 6, BLACK.stroke_width(3))?;
        self.legend.base("its base")
    }

    fn touches(&mut self, trace: &Trace) -> anyhow::Result<()> {
        self.legend.heading("Touches")?;
        if !trace.boards.is_empty() {
            let colour = COLOURS[1].mix(MET_SHADE);
            self.legend
                .board(colour, "board at each contact, and its normal")?;
        }
        // Points may overlap: draw failures on top.
        for drawn in [TouchMark::InPlace, TouchMark::OutOfReach, TouchMark::Late] {
            for (at_m, _) in trace.touched_m.iter().filter(|t| t.1 == drawn) {
                let at = self.pixel((at_m.x, at_m.y));
                self.legend.mark(at, drawn)?;
            }
        }
        for mark in [TouchMark::InPlace, TouchMark::Late, TouchMark::OutOfReach] {
            let count = trace.touched_m.iter().filter(|t| t.1 == mark).count();
            let name = match mark {
                TouchMark::InPlace => "board there before the hand",
                TouchMark::Late => "within reach, but not in time",
                TouchMark::OutOfReach => "out of the arm's reach",
            };
            self.legend.touch(mark, &format!("{name}: {count}"))?;
        }
        self.legend
            .text("Heights are not seen from above: a board")?;
        self.legend.text("at a touch may be above or below it.")
    }

    /// A board seen from above: its face, a line where it is upright, and its normal.
    fn board(&mut self, board: &BoardFace, colour: RGBAColor, width: u32) -> anyhow::Result<()> {
        self.line(outline(board), colour.stroke_width(width))?;
        let (from, normal) = (board.middle_m.truncate(), board.normal.truncate());
        let tip = from + NORMAL_M * normal;
        let (back, side) = (
            from + 0.65 * NORMAL_M * normal,
            0.2 * NORMAL_M * normal.perp(),
        );
        let style = colour.stroke_width(width.min(2));
        for points in [vec![from, tip], vec![back + side, tip, back - side]] {
            self.line(points.iter().map(|p| (p.x, p.y)).collect(), style)?;
        }
        Ok(())
    }
}

/// The face from above: closed, or a single line for an upright board.
fn outline(board: &BoardFace) -> Vec<(f64, f64)> {
    let mut points = board.corners_m.map(DVec3::truncate).to_vec();
    if board.normal.z.abs() < 0.05 {
        let along = board.normal.truncate().perp();
        points.sort_by(|a, b| a.dot(along).total_cmp(&b.dot(along)));
        points = vec![points[0], points[3]];
    } else {
        points.push(points[0]);
    }
    points.iter().map(|p| (p.x, p.y)).collect()
}

/// With one decimal, and zero without a sign.
fn tick(v: &f64) -> String {
    let rounded = (10.0 * v).round() / 10.0;
    format!("{:.1}", if rounded == 0.0 { 0.0 } else { rounded })
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
