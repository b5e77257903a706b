//! Messages for viewers: transforms, scenes, poses, log lines, numbers to plot.

use crate::skeleton::{BASE, BOARD, Skeleton, WORLD};
use crate::view::View;
use glam::{DMat3, DQuat, DVec3};
use hwall::geometry::Pose;
use hwall::hand::{HandFrame, HandPoint};
use hwall::scene::{Scene, SceneError, SurfaceId};
use hwall_protobuf::Writer;
use std::f64::consts::TAU;

/// Red, green, blue, opacity, 0 to 1.
type Color = [f64; 4];

const ARM: Color = [0.75, 0.77, 0.80, 1.0];
const FACE: Color = [0.85, 0.65, 0.35, 1.0];
const WALL: Color = [0.55, 0.62, 0.70, 0.55];
const MOVING: Color = [0.45, 0.60, 0.45, 0.75];
const FORESEEN: Color = [0.95, 0.45, 0.10, 0.9];
const GOAL: Color = [0.15, 0.55, 0.95, 0.9];
const FORCE: Color = [0.85, 0.10, 0.15, 1.0];

/// Standard deviations of the ellipse that contains 90 % of a Gaussian in a plane: the root of -2 ln 0.1.
const REGION_SD: f64 = 2.145_966_026_289_347;
const REGION_CORNERS: usize = 24;
/// Length of a force arrow, m/N; a force below the second value is not drawn, N.
const ARROW_M_PER_N: f64 = 0.02;
const LEAST_FORCE_N: f64 = 0.5;

/// Level of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    Info = 2,
    Warning = 3,
}

fn timestamp(w: &mut Writer<'_>, field: u32, t_ns: u64) {
    const NS: u64 = 1_000_000_000;
    w.message(field, |stamp| {
        stamp.uint64(1, t_ns / NS);
        stamp.uint64(2, t_ns % NS);
    });
}

pub(super) fn vector(w: &mut Writer<'_>, field: u32, v: DVec3) {
    w.message(field, |vector| {
        vector.double(1, v.x);
        vector.double(2, v.y);
        vector.double(3, v.z);
    });
}

fn quaternion(w: &mut Writer<'_>, field: u32, r: &DMat3) {
    let q = DQuat::from_mat3(r);
    w.message(field, |quaternion| {
        quaternion.double(1, q.x);
        quaternion.double(2, q.y);
        quaternion.double(3, q.z);
        quaternion.double(4, q.w);
    });
}

fn pose(w: &mut Writer<'_>, field: u32, pose: &Pose) {
    w.message(field, |p| {
        vector(p, 1, pose.position_m());
        quaternion(p, 2, &pose.rotation());
    });
}

fn color(w: &mut Writer<'_>, field: u32, color: Color) {
    w.message(field, |c| {
        for (number, part) in (1..).zip(color) {
            c.double(number, part);
        }
    });
}

fn transform(w: &mut Writer<'_>, t_ns: u64, parent: &str, child: &str, parent_from_child: &Pose) {
    w.message(1, |t| {
        timestamp(t, 1, t_ns);
        t.string(2, parent);
        t.string(3, child);
        vector(t, 4, parent_from_child.position_m());
        quaternion(t, 5, &parent_from_child.rotation());
    });
}

/// A moving surface: its frame, and how it moves in the scene.
#[derive(Debug, Clone)]
pub(crate) struct MovingFrame {
    pub(crate) name: String,
    pub(crate) path: hwall::haptics::ObjectPath,
}

/// `/tf`: the links of the arm and the moving surfaces.
pub(crate) fn transforms(
    w: &mut Writer<'_>,
    t_ns: u64,
    skeleton: &Skeleton,
    moving: &[MovingFrame],
    view: &View,
) {
    let links = skeleton.transforms(&view.q).zip(&skeleton.links);
    for (joint, (pose, link)) in links.enumerate() {
        transform(w, t_ns, skeleton.parent(joint), link, &pose);
    }
    for (frame, &opening) in moving.iter().zip(&view.openings[..view.moving]) {
        let pose = frame.path.moved(&Pose::IDENTITY, opening);
        transform(w, t_ns, WORLD, &frame.name, &pose);
    }
}

/// `/tf_static`: the board on the last link, and the virtual world.
pub(crate) fn fixed_transforms(
    w: &mut Writer<'_>,
    t_ns: u64,
    skeleton: &Skeleton,
    base_from_world: &Pose,
) {
    let last = skeleton.links.last().map_or(BASE, String::as_str);
    transform(w, t_ns, last, BOARD, &skeleton.last_link_from_board);
    transform(w, t_ns, BASE, WORLD, base_from_world);
}

fn entity(
    w: &mut Writer<'_>,
    t_ns: u64,
    frame: &str,
    id: &str,
    content: impl FnOnce(&mut Writer<'_>),
) {
    w.message(2, |e| {
        timestamp(e, 1, t_ns);
        e.string(2, frame);
        e.string(3, id);
        e.bool(5, true);
        content(e);
    });
}

/// `/scene`: arm, board and surfaces, each static in its own frame.
///
/// Moving surfaces are drawn in their own frames, at opening zero.
pub(crate) fn scene(
    w: &mut Writer<'_>,
    t_ns: u64,
    skeleton: &Skeleton,
    shown: Option<&Scene>,
    moving: &[(SurfaceId, String)],
) -> Result<(), SceneError> {
    for (link, capsule) in skeleton.capsules() {
        entity(w, t_ns, link, &format!("arm/{link}"), |e| {
            let diameter = DVec3::splat(2.0 * capsule.radius_m);
            if let Some(at) = capsule.link_from_cylinder() {
                e.message(10, |cylinder| {
                    pose(cylinder, 1, &at);
                    vector(cylinder, 2, diameter.with_z(capsule.length_m()));
                    cylinder.double(3, 1.0);
                    cylinder.double(4, 1.0);
                    color(cylinder, 5, ARM);
                });
            }
            for end_m in [capsule.from_m, capsule.to_m] {
                e.message(9, |ball| {
                    pose(ball, 1, &Pose::IDENTITY.at(end_m));
                    vector(ball, 2, diameter);
                    color(ball, 3, ARM);
                });
            }
        });
    }
    let board = &skeleton.board;
    let size = DVec3::new(
        2.0 * board.half_width_m,
        2.0 * board.half_height_m,
        board.thickness_m.max(1e-3),
    );
    entity(w, t_ns, BOARD, BOARD, |e| {
        e.message(8, |cube| {
            pose(cube, 1, &Pose::IDENTITY.at(DVec3::NEG_Z * (0.5 * size.z)));
            vector(cube, 2, size);
            color(cube, 3, FACE);
        });
    });
    let Some(scene) = shown else { return Ok(()) };
    for (number, surface) in scene.surfaces().iter().enumerate() {
        let id = SurfaceId(number);
        let own = moving.iter().find(|(moves, _)| *moves == id);
        let frame = own.map_or(WORLD, |(_, name)| name);
        let paint = match (surface.color_rgb, own) {
            (Some([r, g, b]), _) => [r, g, b, WALL[3]],
            (None, Some(_)) => MOVING,
            (None, None) => WALL,
        };
        let triangles = scene.triangles_m(id)?;
        entity(w, t_ns, frame, &format!("surface/{}", surface.name), |e| {
            e.message(12, |list| {
                pose(list, 1, &Pose::IDENTITY);
                for corner in triangles.flatten() {
                    vector(list, 2, corner);
                }
                color(list, 3, paint);
            });
        });
    }
    Ok(())
}

/// `/scene/now`: the predicted point with its 90 % region, the goal, the force of the hand. An absent item is an empty entity,
/// which replaces the previous one.
pub(crate) fn scene_now(w: &mut Writer<'_>, t_ns: u64, skeleton: &Skeleton, view: &View) {
    entity(w, t_ns, BASE, "predicted", |e| {
        let Some(contact) = &view.contact else { return };
        let (u, v) = contact.normal.any_orthonormal_pair();
        e.message(9, |ball| {
            pose(ball, 1, &Pose::IDENTITY.at(contact.point_m));
            vector(ball, 2, DVec3::splat(0.02));
            color(ball, 3, FORESEEN);
        });
        let Some(covariance) = contact.covariance_m2 else {
            return;
        };
        let [a, b] = half_axes_m(&covariance, u, v);
        line(e, 1, FORESEEN, 0.004, |corner| {
            let (sin, cos) = (TAU * corner as f64 / REGION_CORNERS as f64).sin_cos();
            let at_m = contact.point_m + a * cos + b * sin;
            (corner < REGION_CORNERS).then_some(at_m)
        });
    });
    entity(w, t_ns, BASE, "goal", |e| {
        let Some((point_m, normal)) = view.goal else {
            return;
        };
        let normal = normal.normalize_or_zero();
        line(e, 0, GOAL, 0.006, |corner| match corner {
            0 => Some(point_m),
            1 => Some(point_m + 0.1 * normal),
            _ => None,
        });
    });
    entity(w, t_ns, BASE, "force", |e| {
        let force = view.force_n.zip(view.normal_force_n);
        let Some((force_n, _)) = force.filter(|(_, n)| *n >= LEAST_FORCE_N) else {
            return;
        };
        let Some(along) = force_n.try_normalize() else {
            return;
        };
        // The arrow points along +x of its frame and ends on the board; its length shows the force.
        let length_m = (ARROW_M_PER_N * force_n.length()).min(0.5);
        let (y, z) = along.any_orthonormal_pair();
        let tail_m = skeleton.base_from_board(&view.q).position_m() - along * length_m;
        let tail = Pose::from_parts_unchecked(DMat3::from_cols(along, y, z), tail_m);
        e.message(7, |arrow| {
            pose(arrow, 1, &tail);
            arrow.double(2, 0.75 * length_m);
            arrow.double(3, 0.015);
            arrow.double(4, 0.25 * length_m);
            arrow.double(5, 0.03);
            color(arrow, 6, FORCE);
        });
    });
}

/// A line through all points; `kind` 0: open, 1: closed.
fn line(
    e: &mut Writer<'_>,
    kind: u64,
    paint: Color,
    thickness_m: f64,
    point_m: impl Fn(usize) -> Option<DVec3>,
) {
    e.message(11, |line| {
        line.uint64(1, kind);
        pose(line, 2, &Pose::IDENTITY);
        line.double(3, thickness_m);
        for point_m in (0..).map_while(point_m) {
            vector(line, 5, point_m);
        }
        color(line, 6, paint);
    });
}

/// Half axes of the 90 % region in the plane of two unit vectors, m: along the eigenvectors of the covariance in that plane.
fn half_axes_m(covariance_m2: &DMat3, u: DVec3, v: DVec3) -> [DVec3; 2] {
    let entry = |a: DVec3, b: DVec3| a.dot(*covariance_m2 * b);
    let (uu, uv, vv) = (entry(u, u), entry(u, v), entry(v, v));
    let (middle, half) = (0.5 * (uu + vv), 0.5 * (uu - vv));
    let spread = half.hypot(uv);
    let angle = 0.5 * uv.atan2(half);
    let (sin, cos) = angle.sin_cos();
    let sd = |variance: f64| REGION_SD * variance.max(0.0).sqrt();
    [
        (u * cos + v * sin) * sd(middle + spread),
        (v * cos - u * sin) * sd(middle - spread),
    ]
}

/// `/hand`: the tracked palm and fingertips, then the head; orientations are unknown.
pub(crate) fn hand(w: &mut Writer<'_>, t_ns: u64, frame: &HandFrame) {
    timestamp(w, 1, t_ns);
    w.string(2, BASE);
    let points = HandPoint::ALL.map(|point| frame.point(point));
    let head = frame.head_m.filter(|m| m.is_finite());
    for point_m in points.into_iter().chain([head]).flatten() {
        pose(w, 3, &Pose::IDENTITY.at(point_m));
    }
}

/// `/state`: numbers to plot; NaN if absent.
pub(crate) fn state(w: &mut Writer<'_>, view: &View) {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let contact_in_s = view.contact.and_then(|c| c.in_s);
    w.double(1, view.t_s);
    w.uint64(2, u64::from(view.state));
    w.bool(3, view.tracked);
    w.double(4, number(view.normal_force_n));
    vector(w, 5, view.force_n.unwrap_or(DVec3::NAN));
    w.double(6, number(contact_in_s));
    w.double(7, number(view.left_s));
    // Positive: the board arrives before the hand.
    let lead_s = contact_in_s
        .zip(view.left_s)
        .map(|(hand, board)| hand - board);
    w.double(8, number(lead_s));
    w.double(9, number(view.contact.map(|c| c.probability)));
    w.double(10, number(view.contact.map(|c| c.distance_m)));
    w.packed_doubles(11, &view.openings[..view.moving]);
    w.packed_doubles(12, &view.q);
}

/// `/log`.
pub(crate) fn log(w: &mut Writer<'_>, t_ns: u64, level: Level, message: &str) {
    timestamp(w, 1, t_ns);
    w.uint64(2, level as u64);
    w.string(3, message);
    w.string(4, "hwall");
}
