//! One still, painted from far to near.

use super::picture::{Picture, Rgb};
use crate::frame::ViewFrame;
use crate::hand::{HAND_BONES, ViewHand};
use crate::scene::{ViewScene, ViewSurface};
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::surface_axes;
use std::f64::consts::TAU;

const LINK: Rgb = [0.97, 0.98, 0.99];
const HOUSING: Rgb = [0.98, 0.52, 0.14];
const BACK: Rgb = [0.45, 0.48, 0.52];
const SKIN: Rgb = [0.90, 0.66, 0.52];
const WALL: Rgb = [0.42, 0.55, 0.72];
const DOOR: Rgb = [0.66, 0.49, 0.33];
const EDGE: Rgb = [0.33, 0.40, 0.50];
const PREDICTED: Rgb = [0.80, 0.10, 0.55];
const FORCE: Rgb = [0.84, 0.15, 0.20];
const GROUND: Rgb = [0.72, 0.76, 0.80];
/// Most triangles of a surface that are drawn individually.
const MOST_TRIANGLES: usize = 200;
/// Scale of the force arrow, m/N.
const METRES_PER_NEWTON: f64 = 0.02;

/// A shape to be sorted by distance.
enum Shape {
    Capsule(DVec3, DVec3, f64, Rgb),
    Face([DVec3; 4], DVec3, Rgb),
}

impl Shape {
    fn middle_m(&self) -> DVec3 {
        match self {
            Self::Capsule(from_m, to_m, ..) => 0.5 * (*from_m + *to_m),
            Self::Face(corners_m, ..) => 0.25 * corners_m.iter().sum::<DVec3>(),
        }
    }
}

/// Paints the ground, the arm with its board, the walls that face the eye, then everything in front of them.
pub(super) fn draw(picture: &mut Picture, scene: &ViewScene, frame: &ViewFrame) {
    let floor_m = floor_m(scene);
    ground(picture, floor_m);
    let poses = scene.arm.poses(&frame.q);
    let tool = poses.last().copied().unwrap_or(Pose::IDENTITY);
    let mut arm = Vec::new();
    if floor_m < -0.05 {
        let foot_m = DVec3::Z * floor_m;
        arm.push(Shape::Capsule(foot_m, DVec3::ZERO, 0.07, BACK));
    }
    for capsule in &scene.arm.capsules {
        let Some(pose) = poses.get(capsule.frame) else {
            continue;
        };
        let colour = if capsule.housing { HOUSING } else { LINK };
        let ends = [capsule.from_m, capsule.to_m].map(|m| pose.transform_point(m));
        arm.push(Shape::Capsule(ends[0], ends[1], capsule.radius_m, colour));
    }
    arm.extend(board(scene, frame, &tool));
    paint(picture, arm);
    let mut moving = 0;
    for surface in &scene.surfaces {
        let opening = surface.path.map(|_| {
            moving += 1;
            frame.openings.get(moving - 1).copied().unwrap_or(0.0)
        });
        wall(picture, surface, opening.unwrap_or(0.0));
    }
    intent(picture, scene, frame);
    paint(picture, hand(&frame.hand));
    if let Some(force_n) = frame.force_n.filter(|f| f.is_finite() && f.length() > 0.5) {
        arrow(
            picture,
            frame.hand.contact_point_m().unwrap_or(tool.position_m()),
            force_n,
        );
    }
}

fn paint(picture: &mut Picture, mut shapes: Vec<Shape>) {
    let eye_m = picture.camera.eye_m;
    shapes.retain(|shape| shape.middle_m().is_finite());
    shapes.sort_by(|a, b| {
        let far = |shape: &Shape| shape.middle_m().distance_squared(eye_m);
        far(b).total_cmp(&far(a))
    });
    for shape in shapes {
        match shape {
            Shape::Capsule(from_m, to_m, radius_m, colour) => {
                picture.capsule(from_m, to_m, radius_m, colour);
            }
            Shape::Face(corners_m, normal, colour) => picture.face(&corners_m, normal, colour),
        }
    }
}

/// Height of the lowest surface.
fn floor_m(scene: &ViewScene) -> f64 {
    let corners = scene
        .surfaces
        .iter()
        .flat_map(|s| s.triangles_m.iter().flatten());
    let low = corners
        .map(|corner| corner[2])
        .fold(f32::INFINITY, f32::min);
    if low.is_finite() { f64::from(low) } else { 0.0 }
}

fn ground(picture: &mut Picture, floor_m: f64) {
    for i in -4..=8 {
        let s = 0.25 * f64::from(i);
        let (low, high) = (-1.0, 2.0);
        picture.line(
            &[
                DVec3::new(low, s - 0.5, floor_m),
                DVec3::new(high, s - 0.5, floor_m),
            ],
            GROUND,
            0.7,
            "",
        );
        picture.line(
            &[DVec3::new(s, -1.5, floor_m), DVec3::new(s, 1.5, floor_m)],
            GROUND,
            0.7,
            "",
        );
    }
}

/// Mount, edges and face of the board.
fn board(scene: &ViewScene, frame: &ViewFrame, tool: &Pose) -> Vec<Shape> {
    let (w, h) = (scene.board.half_width_m, scene.board.half_height_m);
    let back_m = -scene.board.thickness_m.max(0.012);
    let at = |x: f64, y: f64, z: f64| tool.transform_point(DVec3::new(x * w, y * h, z));
    let colour = frame.state.rgb().map(|c| f64::from(c) / 255.0);
    let turn = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let mut shapes = Vec::new();
    for i in 0..4 {
        let ((x0, y0), (x1, y1)) = (turn[i], turn[(i + 1) % 4]);
        let normal =
            tool.transform_vector(DVec3::new(x0 + x1, y0 + y1, 0.0).normalize_or(DVec3::X));
        let side = [
            at(x0, y0, 0.0),
            at(x1, y1, 0.0),
            at(x1, y1, back_m),
            at(x0, y0, back_m),
        ];
        shapes.push(Shape::Face(side, normal, BACK));
    }
    let normal = tool.transform_vector(DVec3::Z);
    shapes.push(Shape::Face(
        turn.map(|(x, y)| at(x, y, back_m)),
        normal,
        BACK,
    ));
    shapes.push(Shape::Face(
        turn.map(|(x, y)| at(x, y, 0.0)),
        normal,
        colour,
    ));
    let mount = |z: f64| tool.transform_point(DVec3::Z * z);
    shapes.push(Shape::Capsule(
        mount(back_m - 0.03),
        mount(back_m),
        0.042,
        HOUSING,
    ));
    shapes
}

/// The part of a surface whose outside faces the eye, at its current opening.
fn wall(picture: &mut Picture, surface: &ViewSurface, opening: f64) {
    if surface.kind == "untouchable" {
        return;
    }
    let moved = surface
        .path
        .map_or(Pose::IDENTITY, |path| path.moved(&Pose::IDENTITY, opening));
    let eye_m = picture.camera.eye_m;
    let triangles: Vec<[DVec3; 3]> = surface
        .triangles_m
        .iter()
        .map(|corners| corners.map(|c| moved.transform_point(DVec3::from_array(c.map(f64::from)))))
        .filter(|[a, b, c]| (*b - *a).cross(*c - *a).dot(eye_m - *a) > 0.0)
        .collect();
    let colour = if surface.path.is_some() { DOOR } else { WALL };
    if triangles.len() > MOST_TRIANGLES {
        // A scanned wall would take megabytes, so only its outline is drawn.
        picture.outline(triangles.iter().flatten(), colour, 0.12);
        return;
    }
    picture.pane(triangles.iter().map(|t| t.as_slice()), colour, 0.2);
    for [a, b] in rim(&triangles) {
        picture.line(&[a, b], EDGE, 1.1, "");
    }
}

/// Edges that belong to only one triangle.
fn rim(triangles: &[[DVec3; 3]]) -> Vec<[DVec3; 2]> {
    let edges = || {
        triangles
            .iter()
            .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]])
    };
    edges()
        .filter(|[a, b]| !edges().any(|[c, d]| c == *b && d == *a))
        .collect()
}

/// Where the touch is predicted, and where the board is sent.
fn intent(picture: &mut Picture, scene: &ViewScene, frame: &ViewFrame) {
    if let Some((point_m, normal)) = frame.goal
        && let Ok([x, y]) = surface_axes(normal)
    {
        let (w, h) = (scene.board.half_width_m, scene.board.half_height_m);
        let corner = |a: f64, b: f64| point_m + x * (a * w) + y * (b * h);
        let outline = [
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
        ];
        picture.line(
            &outline,
            [0.0, 0.45, 0.70],
            1.5,
            "stroke-dasharray=\"4 2.5\"",
        );
    }
    if let Some(predicted) = frame.predicted {
        if let Some([a, b]) = predicted.region_m {
            let on = |i: usize| {
                let (sin, cos) = (TAU * i as f64 / 36.0).sin_cos();
                predicted.point_m + a * cos + b * sin
            };
            let ring: Vec<DVec3> = (0..=36).map(on).collect();
            // A vague prediction is drawn faintly.
            let style = if a.length() > 0.3 {
                "stroke-opacity=\".35\""
            } else {
                ""
            };
            picture.line(&ring, PREDICTED, 1.6, style);
        }
        picture.dot(predicted.point_m, 2.8, PREDICTED);
    }
}

fn hand(hand: &ViewHand) -> Vec<Shape> {
    let joints = &hand.joints_m;
    let seen = joints.iter().flatten().count();
    let mut shapes = Vec::new();
    let mut bone = |a: usize, b: usize, radius_m: f64| {
        if let (Some(from_m), Some(to_m)) = (joints[a], joints[b]) {
            shapes.push(Shape::Capsule(from_m, to_m, radius_m, SKIN));
        }
    };
    if seen <= 6 {
        // Palm and tips only.
        for tip in [5, 10, 15, 20, 25] {
            bone(0, tip, 0.009);
        }
        bone(0, 0, 0.03);
    } else {
        for [from, to] in HAND_BONES {
            bone(from, to, 0.009);
        }
        for (from, to) in [(6, 11), (11, 16), (16, 21), (7, 12), (12, 17), (17, 22)] {
            bone(from, to, 0.012);
        }
    }
    shapes
}

fn arrow(picture: &mut Picture, tip_m: DVec3, force_n: DVec3) {
    let way = force_n.normalize_or(DVec3::X);
    let length_m = (METRES_PER_NEWTON * force_n.length()).clamp(0.06, 0.4);
    let side = way.any_orthonormal_vector();
    let side = if side.z.abs() > 0.5 {
        side
    } else {
        way.cross(side)
    };
    picture.line(&[tip_m - way * length_m, tip_m], FORCE, 3.0, "");
    let barb = |s: f64| tip_m - way * 0.035 + side * (s * 0.02);
    picture.line(&[barb(1.0), tip_m, barb(-1.0)], FORCE, 3.0, "");
}
