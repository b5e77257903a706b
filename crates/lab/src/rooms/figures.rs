//! The figures of the rooms: stated probabilities, and one touch seen from above and from the person's side.

use crate::contact::figures::unit_square;
use crate::report::figure::{Area, Axes, Chart, Draw, Mesh, Plot, figure};
use crate::rooms::room::{Rectangle, Room};
use crate::rooms::scores::Bin;
use glam::{DMat3, DVec3};
use hwall_contact::ContactPrediction;
use hwall_hand::GazeRay;
use hwall_stage::figures::{COLOURS, TEXT, legend};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::f64::consts::TAU;
use std::path::Path;

/// 90 % of a normal distribution in two dimensions, deviations.
const IN_90_OF_TWO: f64 = 2.145_966;
/// The drawings of a touch leave this free around what happens, m.
const ROUND_M: f64 = 0.08;

/// How often the surface was right over the probability stated, by tenths; the area of a dot tells how many
/// predictions it stands for.
///
/// # Errors
/// A file that cannot be written.
pub fn reliability(path: &Path, title: &str, all: &[(&str, Vec<Bin>)]) -> anyhow::Result<()> {
    let names = [
        "stated probability of the surface",
        "share in which it was right",
    ];
    figure(path, (680, 640), |root| {
        let mut chart = unit_square(root, title, names)?;
        for ((name, bins), colour) in all.iter().zip(COLOURS) {
            let total: usize = bins.iter().map(|b| b.count).sum();
            let line = bins.iter().map(|b| (b.stated, b.right));
            chart
                .line(line, colour.stroke_width(2))?
                .label(*name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 5, colour.filled()));
            let dots = bins.iter().map(|b| {
                let share = b.count as f64 / total as f64;
                let radius = 3 + (14.0 * share.sqrt()) as i32;
                Circle::new((b.stated, b.right), radius, colour.mix(0.7).filled())
            });
            chart.series(dots)?;
        }
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}

/// The predictions at one moment of the touch that is drawn.
pub struct ShownMoment {
    /// Share of the time.
    pub share: f64,
    /// The fusion's most probable prediction.
    pub fused: ContactPrediction,
    /// The line of sight.
    pub gaze: Option<GazeRay>,
    /// That of the ray cast.
    pub cast: Option<ContactPrediction>,
}

/// The touch that is drawn.
pub struct TouchPicture {
    /// Moments, in order.
    pub shown: Vec<ShownMoment>,
    /// The filtered hand.
    pub hand_m: Vec<DVec3>,
    /// Where it touches.
    pub target_m: DVec3,
    /// Above the drawing.
    pub title: String,
}

type Panel<'a, 'p> = Chart<'a, 'p, RangedCoordf64, RangedCoordf64>;

/// One touch from above and from the person's side, with a key below both.
///
/// # Errors
/// A file that cannot be written.
pub fn scene(path: &Path, room: &Room, picture: &TouchPicture) -> anyhow::Result<()> {
    figure(path, (1180, 660), |root| {
        let root = root.below(&picture.title)?;
        let (drawings, below) = root.split_vertically(540);
        let (left, right) = drawings.split_horizontally(610);
        let corners = room.touchable.iter().chain(&room.barriers);
        let corners = corners.flat_map(Rectangle::corners_m);
        let shown = corners.chain(picture.hand_m.iter().copied());
        let (low, high) = shown.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let (low, high) = (low - ROUND_M, high + ROUND_M);
        // The person looks towards smaller x; their right is on the right of both views.
        let above: View = |p| (p.y, p.x);
        let ahead: View = |p| (p.y, p.z);
        for (area, title, name, view) in [
            (&left, "from above (wall at the top)", "x, m", above),
            (&right, "as the person sees it", "z, m", ahead),
        ] {
            let (a, b) = (view(low), view(high));
            let (x, mut y) = same_scale(area.dim_in_pixel(), (a.0, b.0), (a.1, b.1));
            if name == "x, m" {
                // The wall, at small x, is at the top.
                y = y.end..y.start;
            }
            let axes = Axes {
                title,
                names: ["y, m", name],
                formats: [Some(&tenths), Some(&tenths)],
                numbers: [Some(7), Some(7)],
                labels: AXIS_PX.into(),
                margin: 10,
                mesh: Mesh::None,
                text: [TEXT, TEXT],
                ..Axes::default()
            };
            let mut chart = axes.on(area, x, y)?;
            let mut named = Vec::new();
            let (thin, wide) = (
                GREY.mix(0.8).stroke_width(2),
                GREY.mix(0.35).stroke_width(6),
            );
            for (rectangles, style) in [(&room.touchable, thin), (&room.barriers, wide)] {
                for rectangle in rectangles {
                    surface(&mut chart, rectangle, style, view, &mut named)?;
                }
            }
            touch(&mut chart, picture, view)?;
        }
        key(&below, picture)
    })
}

const GREY: RGBColor = COLOURS[6];

type View = fn(DVec3) -> (f64, f64);

/// Pixels of the labels beside the vertical and below the horizontal axis.
const AXIS_PX: (u32, u32) = (58, 46);
/// Pixels of margins and caption, across and up.
const FRAME_PX: (u32, u32) = (20, 50);

/// Widens one of two ranges until a metre is as long on both axes.
fn same_scale(
    (width, height): (u32, u32),
    x: (f64, f64),
    y: (f64, f64),
) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
    let across = f64::from(width.saturating_sub(AXIS_PX.0 + FRAME_PX.0).max(1));
    let up = f64::from(height.saturating_sub(AXIS_PX.1 + FRAME_PX.1).max(1));
    let m_per_px = ((x.1 - x.0) / across).max((y.1 - y.0) / up);
    let range = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = (0.5 * (low + high), 0.5 * pixels * m_per_px);
        middle - half..middle + half
    };
    (range(x, across), range(y, up))
}

/// With one decimal, and without a minus before zero.
fn tenths(value: &f64) -> String {
    format!("{:.1}", (10.0 * value).round() / 10.0 + 0.0)
}

/// Would names at these two pixels cover each other?
fn near(a: (i32, i32), b: (i32, i32)) -> bool {
    (a.0 - b.0).abs() < 50 && (a.1 - b.1).abs() < 15
}

fn surface(
    chart: &mut Panel<'_, '_>,
    rectangle: &Rectangle,
    style: ShapeStyle,
    view: View,
    named: &mut Vec<(i32, i32)>,
) -> anyhow::Result<()> {
    let mut around: Vec<(f64, f64)> = rectangle.corners_m().map(view).to_vec();
    around.push(around[0]);
    chart.series([PathElement::new(around.clone(), style)])?;
    // Beside the upper left corner.
    let low_x = around.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
    let high_y = around.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
    let text = TextStyle::from(("sans-serif", 13))
        .color(&GREY)
        .pos(Pos::new(HPos::Left, VPos::Top));
    // Names at the same corner stand below each other.
    let at = chart.backend_coord(&(low_x, high_y));
    let below = named.iter().filter(|n| near(**n, at)).count() as i32;
    named.push(at);
    let offset =
        EmptyElement::at((low_x, high_y)) + Text::new(rectangle.name, (4, 3 + 15 * below), text);
    chart.series([offset])?;
    Ok(())
}

fn touch(chart: &mut Panel<'_, '_>, picture: &TouchPicture, view: View) -> anyhow::Result<()> {
    let hand = picture.hand_m.iter().map(|&p| view(p));
    chart.line(hand, BLACK.stroke_width(2))?;
    for (shown, colour) in picture.shown.iter().zip(COLOURS) {
        if let Some(gaze) = shown.gaze {
            let end_m = gaze.origin_m + gaze.direction * sight_m(&gaze, &shown.fused);
            let ray = [gaze.origin_m, end_m].map(view);
            let style = colour.mix(0.7).stroke_width(1);
            chart.series(DashedLineSeries::new(ray, 5, 5, style))?;
        }
        if let Some(c) = shown.fused.covariance_m2 {
            let ellipse = ellipse(shown.fused.point_m, c, view);
            chart.series([PathElement::new(ellipse, colour.stroke_width(2))])?;
        }
        chart.series([Circle::new(view(shown.fused.point_m), 4, colour.filled())])?;
        let cast = shown.cast.map(|c| view(c.point_m));
        chart.series(cast.map(|p| TriangleMarker::new(p, 7, colour.filled())))?;
    }
    chart.series([Cross::new(view(picture.target_m), 8, BLACK.stroke_width(3))])?;
    Ok(())
}

/// How far a line of sight is drawn, m: to the plane of the predicted surface, at most 1.5 m.
fn sight_m(gaze: &GazeRay, prediction: &ContactPrediction) -> f64 {
    let slope = gaze.direction.dot(prediction.normal);
    let distance_m = (prediction.point_m - gaze.origin_m).dot(prediction.normal) / slope;
    match distance_m > 0.0 {
        true => distance_m.min(1.5),
        false => 1.5,
    }
}

/// The outline of the 90 % region as seen: the projection of the covariance.
fn ellipse(point_m: DVec3, covariance_m2: DMat3, view: View) -> Vec<(f64, f64)> {
    let units = DVec3::AXES.map(view);
    let u = DVec3::from_array(units.map(|unit| unit.0));
    let v = DVec3::from_array(units.map(|unit| unit.1));
    let along = |a: DVec3, b: DVec3| a.dot(covariance_m2 * b);
    // Cholesky factor of the two by two block.
    let a = along(u, u).max(0.0).sqrt();
    let b = if a > 0.0 { along(u, v) / a } else { 0.0 };
    let c = (along(v, v) - b * b).max(0.0).sqrt();
    let centre = view(point_m);
    circle(60, |sin, cos| {
        let (x, y) = (a * cos, b * cos + c * sin);
        (centre.0 + IN_90_OF_TWO * x, centre.1 + IN_90_OF_TWO * y)
    })
}

/// Points for the sines and cosines of so many equal parts of a turn.
fn circle<P>(parts: u32, point: impl Fn(f64, f64) -> P) -> Vec<P> {
    let angles = (0..=parts).map(|i| f64::from(i) * TAU / f64::from(parts));
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        point(sin, cos)
    };
    angles.map(at).collect()
}

/// The key to colours and marks, in two lines.
fn key(area: &Area<'_>, picture: &TouchPicture) -> anyhow::Result<()> {
    let mut x = 60;
    for (shown, colour) in picture.shown.iter().zip(COLOURS) {
        let line = PathElement::new([(x, 22), (x + 26, 22)], colour.stroke_width(4));
        area.put(&line)?;
        let name = format!(
            "{:.0} % of the time, probability {:.2}",
            100.0 * shown.share,
            shown.fused.probability
        );
        area.write(&name, TEXT, (x + 34, 14))?;
        x += 270;
    }
    let (y, place) = (58, |i: i32| 60 + 180 * i);
    let line = |from: i32, to: i32, style: ShapeStyle| {
        area.put(&PathElement::new([(from, y), (to, y)], style))
    };
    area.put(&Circle::new((place(0) + 13, y), 5, GREY.filled()))?;
    let ring = circle(40, |sin, cos| {
        (place(0) + 13 + (13.0 * cos) as i32, y + (8.0 * sin) as i32)
    });
    area.put(&PathElement::new(ring, GREY.stroke_width(2)))?;
    area.put(&TriangleMarker::new((place(2) + 13, y), 7, GREY.filled()))?;
    for from in [0, 10, 20].map(|dash| place(3) + dash) {
        line(from, from + 5, GREY.stroke_width(1))?;
    }
    line(place(4), place(4) + 26, BLACK.stroke_width(2))?;
    area.put(&Cross::new((place(5) + 13, y), 8, BLACK.stroke_width(3)))?;
    for (i, name) in [
        (0, "learned, fused: point and 90 % region"),
        (2, "ray cast: point"),
        (3, "line of sight"),
        (4, "path of the hand"),
        (5, "where it touches"),
    ] {
        area.write(name, TEXT, (place(i) + 36, y - 8))?;
    }
    Ok(())
}
