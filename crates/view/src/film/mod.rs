//! A touch in a few stills, as SVG.

mod camera;
mod picture;
mod still;

use crate::error::ViewError;
use crate::frame::ViewFrame;
use crate::scene::ViewScene;
use camera::Camera;
use glam::{DVec2, DVec3};
use hwall::numeric::check::finite;
use picture::Picture;
use std::fmt::Write;

/// Stills of a film strip, and how many stand in a row.
const STILLS: usize = 6;
const ROW: usize = 3;
/// Size of a still and the space between two, pixels.
const WIDE: f64 = 312.0;
const HIGH: f64 = 262.0;
const GAP: f64 = 10.0;
/// Of that, the place for words, pixels.
const WORDS: f64 = 44.0;
/// Pixels of a metre at a metre.
const FOCAL: f64 = 345.0;

/// A touch in six stills: arm, wall, hand, board and predicted point in perspective, the time before the contact (`contact_s`, on
/// the clock of the frames) below each. The view is chosen by the last frame: from the person's side, along the surface.
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
        let _ = write!(
            stills,
            "<g transform=\"translate({x} {y})\"><rect width=\"{WIDE}\" height=\"{HIGH}\" rx=\"8\" fill=\"#eef1f5\"/><g clip-path=\"url(#still)\">{}</g>{}</g>\n",
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

/// Eye and target: the person's side of the surface, from the side on which the arm's base stands.
fn standpoint(scene: &ViewScene, last: &ViewFrame) -> (DVec3, DVec3) {
    let tool = scene
        .arm
        .poses(&last.q)
        .last()
        .copied()
        .unwrap_or(hwall::geometry::Pose::IDENTITY);
    let (point_m, normal) = last
        .goal
        .filter(|(point_m, normal)| point_m.is_finite() && normal.is_finite())
        .unwrap_or((tool.position_m(), tool.rotation().z_axis));
    let out = DVec3::new(normal.x, normal.y, 0.0).normalize_or(DVec3::X);
    let side = DVec3::Z.cross(out);
    // The longer way to the arm's base opens the view on it.
    let side = if side.dot(point_m) > 0.0 { side } else { -side };
    let target_m = 0.5 * (point_m + DVec3::new(0.0, 0.0, 0.42)) + out * 0.06;
    (
        target_m + out * 0.95 + side * 1.55 + DVec3::Z * 0.62,
        target_m,
    )
}

/// What stands below a still.
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
        (Some(force_n), ..) if force_n.length() > 0.5 => format!("{:.0} N", force_n.length()),
        (_, Some(board_s), Some(hand_s)) if left_s > 0.0 && frame.goal.is_some() => {
            format!("board there in {board_s:.2} s, hand in {hand_s:.2} s")
        }
        _ => String::new(),
    };
    let (y0, y1) = (HIGH - 26.0, HIGH - 9.0);
    format!(
        "<text x=\"12\" y=\"{y0}\" font-size=\"14.5\" font-weight=\"bold\" fill=\"#1d242d\">{when}</text><rect x=\"12\" y=\"{}\" width=\"11\" height=\"11\" rx=\"2.5\" fill=\"#{r:02x}{g:02x}{b:02x}\"/><text x=\"28\" y=\"{y1}\" font-size=\"13\" fill=\"#1d242d\">{state}<tspan dx=\"8\" fill=\"#5b6672\">{more}</tspan></text>",
        y1 - 10.0,
    )
}

/// What the signs mean.
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
