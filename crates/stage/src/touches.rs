//! The touches of a run: planned for a simulated person, found in a recording, judged at the end.

use crate::foresight::Said;
use crate::session::Tick;
use anyhow::{Context, bail};
use glam::{DAffine3, DVec3};
use hwall_contact::{Reach as HandReach, Recording};
use hwall_haptics::{Board, QUARTER_TURNS_RAD, board_pose};
use hwall_kinematics::{SrsArm, Unreachable, Verdict};
use hwall_scene::{Facet, Scene, SurfaceId};
use hwall_sim::{TouchPlan, TouchTruth};
use hwall_testkit::Sampler;

/// One touch of a surface.
#[derive(Debug, Clone)]
pub struct Touch {
    /// Name of the surface.
    pub surface: String,
    /// Touched point, base frame, m.
    pub point_m: DVec3,
    /// Normal of the surface there, towards the hand.
    pub normal: DVec3,
    /// The hand starts, s.
    pub start_s: f64,
    /// The fingertip crosses the surface, s.
    pub contact_s: f64,
    /// The hand leaves or the reach ends, s.
    pub end_s: f64,
}

/// How the arm did at one touch.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The touch.
    pub touch: Touch,
    /// Why the board cannot be there, if it cannot.
    pub unreachable: Option<Unreachable>,
    /// How long before the hand the board was in place and stayed, s; `None` if it was not.
    pub lead_s: Option<f64>,
    /// Distance of the touched point from the middle of the face, along the face, m.
    pub offset_m: f64,
    /// Distance of the face from the touched point along the surface's normal, m.
    pub gap_m: f64,
    /// From the hand's arrival until the contact was felt, s.
    pub felt_after_s: Option<f64>,
}

/// In place: the touched point at least this far from the board's edge, m ...
const INSET_M: f64 = 0.02;
/// ... the face this near to the surface, m ...
const GAP_M: f64 = 0.005;
/// ... and parallel to it within this, rad.
const TILT_RAD: f64 = 0.035;

/// A contact may be felt a little before the noise-free crossing, s.
const FELT_EARLY_S: f64 = 0.05;

/// People touch between the hip and a little above the eyes, m from the eyes.
const BELOW_EYES_M: f64 = 0.85;
const ABOVE_EYES_M: f64 = 0.3;

/// Chooses points for a simulated person: surfaces in turn, five of six touches within reach.
///
/// # Errors
/// A scene in which too few points are visible and free before the hand.
pub fn plan(
    scene: &Scene,
    arm: &SrsArm,
    (head_m, hand_m): (DVec3, DVec3),
    count: usize,
    seed: u64,
) -> anyhow::Result<Vec<TouchPlan>> {
    let mut sampler = Sampler::new(seed);
    let patches: Vec<Facet> = scene.vertical_facets();
    if patches.is_empty() {
        bail!("the scene has no vertical surface that can be touched");
    }
    let mut plans = Vec::new();
    for i in 0..count {
        let want_reachable = i % 6 != 5;
        let found = (0..20_000).find_map(|attempt| {
            // Surfaces in turn; one that offers nothing is passed over after a while.
            let patch = &patches[(i + attempt / 200) % patches.len()];
            let point_m = inside(patch, &mut sampler)?;
            let normal = facing(patch.normal, head_m - point_m);
            let suits = point_m.distance(hand_m) < 1.1
                && (head_m.z - BELOW_EYES_M..head_m.z + ABOVE_EYES_M).contains(&point_m.z)
                && reason(arm, point_m, normal).ok()?.is_none() == want_reachable
                && scene.visible(head_m, point_m + normal * 0.01).ok()?
                && scene.visible(hand_m, point_m + normal * 0.05).ok()?;
            suits.then_some(TouchPlan {
                target_m: point_m,
                normal,
            })
        });
        match found {
            Some(plan) => plans.push(plan),
            // A scene that is all within reach is no fault.
            None if !want_reachable => {}
            None => {
                bail!("found no free point within the arm's reach on the scene's vertical surfaces")
            }
        }
    }
    Ok(plans)
}

/// The touches that a simulated person made.
#[must_use]
pub fn of_person(scene: &Scene, truths: &[TouchTruth]) -> Vec<Touch> {
    let surface = |point_m: DVec3| {
        let closest = scene.closest_touchable(point_m, 0.05).ok().flatten();
        closest.map_or("?".to_owned(), |c| scene.surface(c.surface).name.clone())
    };
    let touch = |t: &TouchTruth| Touch {
        surface: surface(t.target_m),
        point_m: t.target_m,
        normal: t.normal,
        start_s: t.start_s,
        contact_s: t.contact_s,
        end_s: t.release_s,
    };
    truths.iter().map(touch).collect()
}

/// The touches in a recording: where each reach first goes through a touchable surface, or the
/// surface beside its end.
///
/// # Errors
/// Geometry that the scene refuses.
pub fn of_recording(
    scene: &Scene,
    recording: &Recording,
    base_from_hand: DAffine3,
    contacts: &[HandReach],
) -> anyhow::Result<Vec<Touch>> {
    let mut touches = Vec::new();
    for reach in contacts {
        let path: Vec<(f64, DVec3)> = recording.samples[reach.first..=reach.last]
            .iter()
            .filter_map(|s| {
                Some((
                    s.frame.t_s,
                    base_from_hand.transform_point3(s.frame.point(reach.point)?),
                ))
            })
            .collect();
        let Some((contact_s, point_m, normal, id)) = first_contact(scene, &path)? else {
            continue;
        };
        let surface = scene.surface(id).name.clone();
        let (start_s, end_s) = (reach.start_s, reach.end_s + 0.3);
        touches.push(Touch {
            surface,
            point_m,
            normal,
            start_s,
            contact_s,
            end_s,
        });
    }
    Ok(touches)
}

/// A path that ends within this of a surface has touched it, m: a tracked tip is a point inside
/// the finger.
const BESIDE_M: f64 = 0.03;

type Contact = (f64, DVec3, DVec3, SurfaceId);

fn first_contact(scene: &Scene, path: &[(f64, DVec3)]) -> anyhow::Result<Option<Contact>> {
    for pair in path.windows(2) {
        let [(_, from), (t_s, to)] = [pair[0], pair[1]];
        let step = to - from;
        if step.length() < 1e-9 {
            continue;
        }
        let hit = scene
            .ray_cast(from, step)?
            .filter(|h| h.distance_m <= step.length());
        if let Some(hit) = hit.filter(|h| scene.surface(h.surface).touchable()) {
            return Ok(Some((t_s, hit.point_m, hit.normal, hit.surface)));
        }
    }
    let Some(&(t_s, end)) = path.last() else {
        return Ok(None);
    };
    let beside = scene.closest_touchable(end, BESIDE_M)?;
    Ok(beside.map(|c| (t_s, c.point_m, c.normal, c.surface)))
}

/// Judges every touch from the log of the run.
///
/// # Errors
/// A touch outside the run.
pub fn judge(
    arm: &SrsArm,
    board: &Board,
    touches: &[Touch],
    ticks: &[Tick],
) -> anyhow::Result<Vec<Outcome>> {
    touches
        .iter()
        .map(|touch| judge_one(arm, board, touch, ticks))
        .collect()
}

fn judge_one(
    arm: &SrsArm,
    board: &Board,
    touch: &Touch,
    ticks: &[Tick],
) -> anyhow::Result<Outcome> {
    let at = ticks.partition_point(|tick| tick.t_s <= touch.contact_s);
    let last = at.checked_sub(1).context("a touch before the run began")?;
    let in_place = |tick: &Tick| {
        let p = tick
            .base_from_board
            .inverse()
            .transform_point(touch.point_m);
        let on_board =
            p.x.abs() <= board.half_width_m - INSET_M && p.y.abs() <= board.half_height_m - INSET_M;
        let tilt = tick
            .base_from_board
            .rotation()
            .z_axis
            .angle_between(touch.normal);
        on_board && p.z.abs() <= GAP_M && tilt <= TILT_RAD
    };
    let steady = ticks[..=last]
        .iter()
        .rev()
        .take_while(|tick| in_place(tick))
        .last();
    let p = ticks[last]
        .base_from_board
        .inverse()
        .transform_point(touch.point_m);
    // A press that is felt elsewhere is not this touch.
    let board_holds = |tick: &Tick| {
        let p = tick
            .base_from_board
            .inverse()
            .transform_point(touch.point_m);
        p.x.abs() <= board.half_width_m && p.y.abs() <= board.half_height_m
    };
    let from = ticks.partition_point(|tick| tick.t_s < touch.contact_s - FELT_EARLY_S);
    let felt = ticks[from..]
        .iter()
        .take_while(|tick| tick.t_s <= touch.end_s)
        .find(|tick| tick.in_contact && board_holds(tick));
    Ok(Outcome {
        touch: touch.clone(),
        unreachable: reason(arm, touch.point_m, touch.normal)?,
        lead_s: steady.map(|tick| touch.contact_s - tick.t_s),
        offset_m: p.truncate().length(),
        gap_m: p.z.abs(),
        felt_after_s: felt.map(|tick| tick.t_s - touch.contact_s),
    })
}

/// A prediction is right on the touched surface and this near to the touched point, m: half the
/// board's half width.
pub const RIGHT_M: f64 = 0.05;

/// For how long before each touch each predictor had been right without a break, s, in the order
/// of [`Kind::ALL`](crate::foresight::Kind::ALL); `None`: wrong in the last sample.
///
/// Samples before the touch before was over do not count.
#[must_use]
pub fn leads(scene: &Scene, touches: &[Touch], said: &[Said]) -> Vec<[Option<f64>; 3]> {
    let mut since_s = f64::NEG_INFINITY;
    let of_touch = |touch: &Touch| {
        let from = said.partition_point(|s| s.t_s <= since_s);
        let until = said.partition_point(|s| s.t_s <= touch.contact_s).max(from);
        since_s = touch.end_s;
        std::array::from_fn(|i| {
            let right = |s: &&Said| {
                s.first[i].is_some_and(|(surface, point_m)| {
                    scene.surface(surface).name == touch.surface
                        && point_m.distance(touch.point_m) <= RIGHT_M
                })
            };
            let first = said[from..until].iter().rev().take_while(right).last();
            first.map(|s| touch.contact_s - s.t_s)
        })
    };
    touches.iter().map(of_touch).collect()
}

/// Why no quarter turn of the board can present a point; `None` if one can.
fn reason(arm: &SrsArm, point_m: DVec3, normal: DVec3) -> anyhow::Result<Option<Unreachable>> {
    let mut first = None;
    for roll in QUARTER_TURNS_RAD {
        match arm.verdict(&board_pose(point_m, normal, roll)?) {
            Verdict::Reachable(_) => return Ok(None),
            Verdict::Unreachable(why) => first = first.or(Some(why)),
        }
    }
    Ok(first)
}

/// A random point of a patch, a hand's breadth from its outline.
fn inside(patch: &Facet, sampler: &mut Sampler) -> Option<DVec3> {
    const EDGE_M: f64 = 0.08;
    let low = patch.outline_m.iter().copied().reduce(DVec3::min)?;
    let high = patch.outline_m.iter().copied().reduce(DVec3::max)?;
    let drawn = sampler.point_in_box(low, high);
    let point = drawn - patch.normal * (drawn - patch.point_m).dot(patch.normal);
    let n = patch.outline_m.len();
    let clear = (0..n).all(|i| {
        let (a, b) = (patch.outline_m[i], patch.outline_m[(i + 1) % n]);
        let inward = patch.normal.cross(b - a).normalize_or_zero();
        (point - a).dot(inward) >= EDGE_M
    });
    clear.then_some(point)
}

fn facing(normal: DVec3, towards: DVec3) -> DVec3 {
    if normal.dot(towards) < 0.0 {
        -normal
    } else {
        normal
    }
}
