//! A touch as a few stills, in SVG.

mod camera;
mod picture;
mod still;

use crate::error::ViewError;
use crate::frame::ViewFrame;
use crate::scene::ViewScene;
use crate::state::ViewState;
use camera::Camera;
use glam::{DVec2, DVec3};
use hwall::geometry::Pose;
use hwall::numeric::check::finite;
use picture::Picture;
use std::fmt::Write;

/// A touch ends below this force, N; the force readings of an untouched board are smaller.
const LEAST_FORCE_N: f64 = 1.5;
/// Number of stills in a film strip, and number of stills in a row.
const STILLS: usize = 6;
const ROW: usize = 3;
/// Size of a still and the space between two stills, pixels.
const WIDE: f64 = 312.0;
const HIGH: f64 = 262.0;
const GAP: f64 = 10.0;
/// Height of the text below a still, included in its height, pixels.
const WORDS: f64 = 44.0;
/// Focal length, pixels.
const FOCAL: f64 = 345.0;

/// A touch in six stills: arm, wall, hand, board and predicted point in perspective, with the time to the contact (`contact_s`, on the
/// clock of the frames) below each. The last frame determines the view: from the person's side, along the surface.
///
/// # Errors
/// Fewer or more than six frames; times that are not finite.
pub fn film_strip(
    scene: &ViewScene,
    frames: &[ViewFrame],
    contact_s: f64,
) -> Result<String, ViewError> {
    finite("contact_s", contact_s)?;
    for frame in frames {
        finite("t_s", frame.t_s)?;
    }
    let &[.., last] = frames else {
        return Err(wrong_count(frames));
    };
    if frames.len() != STILLS {
        return Err(wrong_count(frames));
    }
    let (eye_m, target_m) = standpoint(scene, &last);
    let middle_px = DVec2::new(0.5 * WIDE, 0.5 * (HIGH - WORDS));
    let camera = Camera::new(eye_m, target_m, FOCAL, middle_px);
    let rows = STILLS.div_ceil(ROW) as f64;
    let wide = ROW as f64 * (WIDE + GAP) + GAP;
    let high = rows * (HIGH + GAP) + GAP + 24.0;
    let mut stills = String::new();
    let mut gradients = String::new();
    for (i, frame) in frames.iter().enumerate() {
        let mut picture = Picture::new(camera, &format!("s{i}g"));
        still::draw(&mut picture, scene, frame);
        let x = GAP + (i % ROW) as f64 * (WIDE + GAP);
        let y = GAP + (i / ROW) as f64 * (HIGH + GAP);
        let _ = writeln!(
            stills,
            "<g transform=\"translate({x} {y})\"><rect width=\"{WIDE}\" height=\"{HIGH}\" rx=\"8\" fill=\"#eef1f5\"/><g clip-path=\"url(#still)\">{}</g>{}</g>",
            picture.body,
            words(frame, contact_s)
        );
        gradients.push_str(&picture.gradients);
    }
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {wide} {high}\" width=\"{wide}\" height=\"{high}\" font-family=\"sans-serif\">\n<title>{}</title>\n<defs><clipPath id=\"still\"><rect width=\"{WIDE}\" height=\"{}\" rx=\"8\"/></clipPath>{gradients}</defs>\n<rect width=\"{wide}\" height=\"{high}\" fill=\"#ffffff\"/>\n{stills}{}</svg>\n",
        escaped(&scene.title),
        HIGH - WORDS,
        legend(high - 12.0),
    ))
}

fn wrong_count(frames: &[ViewFrame]) -> ViewError {
    ViewError::FrameCount {
        what: "a film strip",
        needed: STILLS,
        got: frames.len(),
    }
}

/// Eye and target: on the person's side of the surface and to one side of it, where fewer walls hide the arm.
fn standpoint(scene: &ViewScene, last: &ViewFrame) -> (DVec3, DVec3) {
    let poses = scene.arm.poses(&last.q);
    let tool = poses.last().copied().unwrap_or(Pose::IDENTITY);
    let (point_m, normal) = last
        .goal
        .filter(|(point_m, normal)| point_m.is_finite() && normal.is_finite())
        .unwrap_or((tool.position_m(), tool.rotation().z_axis));
    let out = DVec3::new(normal.x, normal.y, 0.0).normalize_or(DVec3::X);
    let target_m = 0.5 * (point_m + DVec3::new(0.0, 0.0, 0.40)) + out * 0.10;
    let eye_m = |side: DVec3| target_m + out * 0.55 + side * 1.68 + DVec3::Z * 0.42;
    let sides = [out.cross(DVec3::Z), DVec3::Z.cross(out)];
    let hidden = |side: &DVec3| -> usize {
        let eye_m = eye_m(*side);
        poses
            .iter()
            .map(|pose| panes_before(scene, eye_m, pose.position_m()))
            .sum()
    };
    let side = sides.into_iter().min_by_key(hidden).unwrap_or(DVec3::Y);
    (eye_m(side), target_m)
}

/// Number of triangles facing the eye that stand between it and a point.
fn panes_before(scene: &ViewScene, eye_m: DVec3, place_m: DVec3) -> usize {
    let way_m = place_m - eye_m;
    let touchable = scene.surfaces.iter().filter(|s| s.kind != "untouchable");
    let triangles = touchable.flat_map(|s| &s.triangles_m);
    triangles
        .filter(|corners| {
            let [a, b, c] = corners.map(|c| DVec3::from_array(c.map(f64::from)));
            let (u, v) = (b - a, c - a);
            let h = way_m.cross(v);
            // Positive if the ray meets the outside of the triangle.
            let determinant = u.dot(h);
            let s = (eye_m - a).dot(h) / determinant;
            let q = (eye_m - a).cross(u);
            let (t, along) = (way_m.dot(q) / determinant, v.dot(q) / determinant);
            determinant > 0.0
                && s >= 0.0
                && t >= 0.0
                && s + t <= 1.0
                && (0.0..=1.0).contains(&along)
        })
        .count()
}

/// The text below a still.
fn words(frame: &ViewFrame, contact_s: f64) -> String {
    let left_s = contact_s - frame.t_s;
    let when = match left_s {
        s if s >= 0.005 => format!("{s:.2} s before the touch"),
        s if s > -0.005 => "the touch".to_owned(),
        s => format!("{:.2} s after the touch began", -s),
    };
    let [r, g, b] = frame.state.rgb();
    let state = frame.state.name();
    let more = match (
        frame.force_n,
        frame.left_s,
        frame.predicted.and_then(|p| p.contact_s),
    ) {
        (Some(force_n), ..) if force_n.length() > LEAST_FORCE_N => {
            format!("{:.0} N", force_n.length())
        }
        // The arrival of the hand is a prediction; the title gives the actual time.
        (_, _, Some(hand_s)) if left_s > 0.0 && frame.state == ViewState::InPlace => {
            format!("hand in about {hand_s:.2} s")
        }
        (_, Some(board_s), Some(hand_s)) if left_s > 0.0 && frame.goal.is_some() => {
            format!("board in {board_s:.2} s, hand \u{2248} {hand_s:.2} s")
        }
        _ => String::new(),
    };
    let (y0, y1) = (HIGH - 26.0, HIGH - 9.0);
    format!(
        "<text x=\"12\" y=\"{y0}\" font-size=\"14.5\" font-weight=\"bold\" fill=\"#1d242d\">{when}</text><rect x=\"12\" y=\"{}\" width=\"11\" height=\"11\" rx=\"2.5\" fill=\"#{r:02x}{g:02x}{b:02x}\"/><text x=\"28\" y=\"{y1}\" font-size=\"13\" fill=\"#1d242d\">{state}<tspan dx=\"8\" font-size=\"12\" fill=\"#5b6672\">{more}</tspan></text>",
        y1 - 10.0,
    )
}

/// Legend of the signs.
fn legend(y: f64) -> String {
    let text = |x: f64, text: &str| {
        format!("<text x=\"{x}\" y=\"{y}\" font-size=\"13\" fill=\"#3d4753\">{text}</text>")
    };
    let ring = format!(
        "<ellipse cx=\"24\" cy=\"{0}\" rx=\"10\" ry=\"6.5\" fill=\"none\" stroke=\"#cc1a8c\" stroke-width=\"1.8\"/><circle cx=\"24\" cy=\"{0}\" r=\"2.6\" fill=\"#cc1a8c\"/>",
        y - 4.5
    );
    let goal = format!(
        "<rect x=\"372\" y=\"{}\" width=\"14\" height=\"12\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.6\" stroke-dasharray=\"4 2.5\"/>",
        y - 10.5
    );
    ring + &text(40.0, "predicted touch and its 90 % region")
        + &goal
        + &text(
            393.0,
            "where the board is sent; its face has the colour of its state",
        )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
