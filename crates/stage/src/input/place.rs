//! Placement of the arm and a recording in a scene.
//!
//! A recording made without a virtual wall does not contain the wall's position. Placement
//! chooses a wall of the scene, the arm's base behind it, and the pose of the recording such that its reaches end on the wall.

use crate::input::floor_pose::FloorPose;
use crate::input::numbers::counted;
use crate::input::scene_file::looks_like;
use anyhow::bail;
use glam::{DMat3, DVec3, dvec3};
use hwall_hand::{HandPoint, Reach, ReachEnd, Recording, SegmentConfig, reaches};
use hwall_scene::{Facet, Scene};

/// Distance of the arm behind the wall, and of its base below the touched points, m:
/// well inside the reach of both iiwa arms.
pub(crate) const BEHIND_M: f64 = 0.62;
const BELOW_M: f64 = 0.55;

/// Least length of a reach, m; the shorter one applies if a recording has no long reach.
const LONG_M: f64 = 0.3;
const SHORT_M: f64 = 0.15;

/// Thresholds for choosing a direction: difference in the share of touches, and in distance from the head, m.
const MORE_TOUCHES: f64 = 0.5;
const FROM_HEAD_M: f64 = 0.1;
/// Longest delay of a contact after the end of its movement, s.
const TOUCH_AFTER_S: f64 = 0.2;

/// Spacing of the points tried on a wall, and their least distance from its border, m.
const STEP_M: f64 = 0.25;
const BORDER_M: f64 = 0.25;

/// A wall must be at least this wide and high, m.
const WALL_M: f64 = 0.6;

/// Within this distance of the wall, m, the wall itself does not count as an obstacle.
const TOUCHING_M: f64 = 0.01;

/// Placement of arm and recording in the scene.
#[derive(Debug, Clone)]
pub struct Placement {
    /// The arm's base in the scene.
    pub base: FloorPose,
    /// The recording's (z-up) origin in the scene.
    pub hand: FloorPose,
    /// For the user: what was chosen and why.
    pub remark: String,
}

/// The movements of a recording that end in a contact, and the criterion that selected them.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    /// The movements.
    pub reaches: Vec<Reach>,
    /// For the user: which movements, and why.
    pub remark: String,
}

/// The reaches that end in a contact. A hand moves to and fro; the chosen direction is the one that ends in recorded touches;
/// else, with a recorded head, the one away from the head; else the one whose ends lie much closer together (a wall stops the
/// hand at one place, a resting hand may be anywhere); else the first.
///
/// Movements are segmented by the steadiest point. Their ends are read from the index tip if it is recorded, as
/// in the prediction.
/// `rigid`: a synthetic hand whose shape never changes; this does not count as a frozen tracker.
///
/// # Errors
/// A recording without a complete reach; the error says what was found instead.
pub fn reaches_to_contact(recording: &Recording, rigid: bool) -> anyhow::Result<Contacts> {
    let of_length = |min_length_m: f64, rigid: bool| -> anyhow::Result<Vec<Reach>> {
        let default = SegmentConfig::default();
        let config = SegmentConfig {
            min_length_m,
            freeze: default.freeze.filter(|_| !rigid),
            ..default
        };
        let found = reaches(recording, &config)?;
        let complete = found
            .into_iter()
            .filter(|r| r.end != ReachEnd::TrackingLost);
        Ok(complete.map(|r| of_index_tip(recording, r)).collect())
    };
    let mut complete = of_length(LONG_M, rigid)?;
    if complete.is_empty() {
        complete = of_length(SHORT_M, rigid)?;
    }
    let Some(first) = complete.first().map(|r| r.direction) else {
        let rigid_ones = of_length(SHORT_M, true)?.len();
        if rigid_ones > 0 {
            bail!(
                "no complete reach of {SHORT_M} m or more: {}, but the hand's shape never changes, as with a \
                 frozen tracker; for a made-up hand give --rigid-hand",
                counted(rigid_ones, "movement", "movements")
            );
        }
        bail!(
            "no complete reach of {SHORT_M} m or more in {:.1} s (metres and seconds?)",
            recording.duration_s()
        );
    };
    let (to, fro): (Vec<Reach>, Vec<Reach>) = complete
        .into_iter()
        .partition(|r| r.direction.dot(first) > 0.0);
    let scatter = |group: &[Reach]| {
        let mean = mean(group.iter().map(|r| r.end_m));
        let squares = group
            .iter()
            .map(|r| r.end_m.distance_squared(mean))
            .sum::<f64>();
        (squares / group.len() as f64).sqrt()
    };
    let by = |of: fn(&Recording, &Reach) -> Option<f64>, least: f64| {
        let [to, fro] =
            [&to, &fro].map(|group| mean_of(group.iter().filter_map(|r| of(recording, r))));
        let more = to? - fro?;
        (more.abs() >= least).then_some(more < 0.0)
    };
    let knows_touches = recording.samples.iter().any(|s| s.contact == Some(true));
    let by_touches = knows_touches
        .then(|| by(ends_in_touch, MORE_TOUCHES))
        .flatten();
    let (swap, why) = if let Some(swap) = by_touches {
        (swap, "they end in the touches recorded")
    } else if let Some(swap) = by(from_head_m, FROM_HEAD_M) {
        (swap, "they lead away from the head")
    } else if to.len() > 1 && fro.len() > 1 && scatter(&fro) < 0.5 * scatter(&to) {
        // A single end has no scatter, and small differences are random.
        (
            true,
            "their ends lie closest together; without a head or a column contact nothing else tells them from the way back",
        )
    } else {
        (false, "the first direction")
    };
    let chosen = if swap { fro } else { to };
    let starts: Vec<String> = chosen.iter().map(|r| format!("{:.2}", r.start_s)).collect();
    let remark = format!(
        "taken as reaches: the movements that start at {} s ({why})",
        starts.join(", ")
    );
    Ok(Contacts {
        reaches: chosen,
        remark,
    })
}

/// 1 if the movement ends in a touch, 0 if not.
fn ends_in_touch(recording: &Recording, reach: &Reach) -> Option<f64> {
    // A retraction begins in a touch, so only use the second half.
    let middle = reach.first.midpoint(reach.last);
    let end = recording.samples[middle..].iter();
    let mut end = end.take_while(|s| s.frame.t_s <= reach.end_s + TOUCH_AFTER_S);
    Some(f64::from(u8::from(end.any(|s| s.contact == Some(true)))))
}

/// Change of distance from the head over a movement, m.
fn from_head_m(recording: &Recording, reach: &Reach) -> Option<f64> {
    let distance_m = |sample: usize, point_m: DVec3| {
        let head_m = recording.samples[sample].frame.head_m?;
        Some(head_m.distance(point_m)).filter(|m| m.is_finite())
    };
    Some(distance_m(reach.last, reach.end_m)? - distance_m(reach.first, reach.start_m)?)
}

fn mean_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// The same movement of the index tip, if it was seen at both ends.
fn of_index_tip(recording: &Recording, reach: Reach) -> Reach {
    let tip = |sample: usize| recording.samples[sample].frame.point(HandPoint::Index);
    let (Some(start_m), Some(end_m)) = (tip(reach.first), tip(reach.last)) else {
        return reach;
    };
    let Some(direction) = (end_m - start_m).try_normalize() else {
        return reach;
    };
    let length_m = start_m.distance(end_m);
    Reach {
        point: HandPoint::Index,
        start_m,
        end_m,
        direction,
        length_m,
        ..reach
    }
}

/// Chooses a wall and places arm and recording in front of it.
///
/// Takes the wall nearest to `near_m` (the arm's base if given, else the middle of the scene) among those that
/// are large enough and have free space in front. The recording is placed with the wall's plane at the end of
/// the shortest reach; every reach then crosses it.
///
/// # Errors
/// No reach in the recording, no suitable wall in the scene.
pub fn before_a_wall(
    scene: &Scene,
    recording: &Recording,
    contacts: &[Reach],
    base: Option<FloorPose>,
) -> anyhow::Result<Placement> {
    let toward = mean(contacts.iter().map(|r| r.direction));
    let toward = dvec3(toward.x, toward.y, 0.0);
    if toward.length() < 0.1 {
        bail!("the reaches of the recording are vertical: give --hand-origin and --base");
    }
    let toward = toward.normalize();
    let middle = mean(contacts.iter().map(|r| r.end_m));
    let shortest = contacts
        .iter()
        .map(|r| (r.end_m - middle).dot(toward))
        .fold(f64::INFINITY, f64::min);
    // A contact point in the recording, and the bounds of the reaches' paths, which must be free of obstacles.
    let touched_m = middle + toward * (shortest - 0.002);
    let hwall_scene::Bounds {
        min_m: min,
        max_m: max,
    } = scene.bounds();
    let near_m = base.map_or(0.5 * (min + max), |b| b.origin_m);
    let mut candidates: Vec<(f64, DVec3, Facet)> = Vec::new();
    for patch in scene.vertical_facets() {
        let (low, high) = (patch.lowest_m, patch.highest_m);
        if patch.width_m < WALL_M || high - low < WALL_M {
            continue;
        }
        // Points to touch, at a height that a standing person reaches, `BORDER_M` inside the border.
        let along = DVec3::Z.cross(patch.normal).normalize_or_zero();
        let height = (low + 1.2).min(high - BORDER_M).max(low + BORDER_M);
        let count = ((patch.width_m - 2.0 * BORDER_M) / STEP_M).floor().max(0.0) as i32;
        for i in 0..=count {
            let offset = along * (STEP_M * (f64::from(i) - 0.5 * f64::from(count)));
            let point = DVec3 {
                z: height,
                ..patch.point_m + offset
            };
            if solid(scene, &patch, point, along)? {
                candidates.push((point.distance(near_m), point, patch.clone()));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = candidates.len();
    for (_, point, patch) in candidates {
        let normal = dvec3(patch.normal.x, patch.normal.y, 0.0).normalize();
        let yaw_rad = heading(-normal) - heading(toward);
        let turn = DMat3::from_rotation_z(yaw_rad);
        let hand = FloorPose {
            origin_m: point - turn * touched_m,
            yaw_rad,
        };
        if !free(scene, recording, contacts, &hand, (point, normal))? {
            continue;
        }
        let own = base_behind(point, normal);
        let remark = format!(
            "{} placed on {:?} at ({:.2}, {:.2}, {:.2}) of the scene; their ends scatter by {:.0} mm",
            counted(contacts.len(), "reach", "reaches"),
            scene.surface(patch.surface).name,
            point.x,
            point.y,
            point.z,
            1e3 * contacts
                .iter()
                .map(|r| r.end_m.distance(middle))
                .fold(0.0, f64::max)
        );
        return Ok(Placement {
            base: base.unwrap_or(own),
            hand,
            remark,
        });
    }
    bail!(
        "none of {} of the scene is free before the recorded hand: give --hand-origin and --base ({})",
        counted(count, "wall", "walls"),
        looks_like(scene)
    )
}

/// The arm's base behind a point of a wall with a horizontal normal: the point is well within reach.
#[must_use]
pub fn base_behind(point_m: DVec3, normal: DVec3) -> FloorPose {
    FloorPose {
        origin_m: point_m - normal * BEHIND_M - DVec3::Z * BELOW_M,
        yaw_rad: heading(normal),
    }
}

/// Is the wall solid around the point, without a door or window?
fn solid(scene: &Scene, patch: &Facet, point: DVec3, along: DVec3) -> anyhow::Result<bool> {
    for (x, z) in [
        (0.0, 0.0),
        (-0.2, -0.2),
        (0.2, -0.2),
        (-0.2, 0.2),
        (0.2, 0.2),
    ] {
        let beside = point + along * x + DVec3::Z * z;
        let closest = scene.closest_touchable(beside, 0.01)?;
        if closest.is_none_or(|c| c.surface != patch.surface) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Is there nothing between the recorded reaches and the wall?
fn free(
    scene: &Scene,
    recording: &Recording,
    contacts: &[Reach],
    hand: &FloorPose,
    (wall_m, normal): (DVec3, DVec3),
) -> anyhow::Result<bool> {
    let scene_from_hand = hand.outer_from_here();
    for reach in contacts {
        let path: Vec<DVec3> = (reach.first..=reach.last)
            .filter_map(|i| recording.samples[i].frame.point(reach.point))
            .map(|p| scene_from_hand.transform_point3(p))
            .filter(|p| (*p - wall_m).dot(normal) > TOUCHING_M)
            .collect();
        for pair in path.windows(2) {
            if pair[0] != pair[1] && !scene.visible(pair[0], pair[1])? {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

fn heading(v: DVec3) -> f64 {
    v.y.atan2(v.x)
}

fn mean(points: impl ExactSizeIterator<Item = DVec3>) -> DVec3 {
    let count = points.len() as f64;
    points.sum::<DVec3>() / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::{HandFrame, Sample};

    /// Three reaches to different ends, by a hand that returns to one place.
    fn recording(head: bool, contact: bool) -> Recording {
        let rest_m = dvec3(0.3, 0.0, 1.0);
        let ends_m = [-0.3, 0.0, 0.3].map(|y| dvec3(0.8, y, 1.2));
        let mut samples = Vec::new();
        for k in 0..600_u32 {
            let (cycle, t_s) = ((k / 200) as usize, f64::from(k % 200) * 0.0125);
            let ease = |from_s: f64| {
                let tau = ((t_s - from_s) / 0.6).clamp(0.0, 1.0);
                tau * tau * (3.0 - 2.0 * tau)
            };
            let at_m = rest_m.lerp(ends_m[cycle], ease(0.4) - ease(1.5));
            let mut frame = HandFrame::empty(f64::from(k) * 0.0125);
            for point in [HandPoint::Palm, HandPoint::Index] {
                frame.set_point(point, Some(at_m));
            }
            frame.head_m = head.then_some(dvec3(0.1, 0.0, 1.5));
            samples.push(Sample {
                frame,
                contact: contact.then_some((1.0..1.5).contains(&t_s)),
                ..Sample::default()
            });
        }
        Recording {
            samples,
            ..Recording::default()
        }
    }

    #[test]
    fn touches_and_the_head_tell_reaches_from_ways_back() {
        for (head, contact, why) in [
            (false, true, "touches"),
            (true, false, "head"),
            (true, true, "touches"),
        ] {
            let found = reaches_to_contact(&recording(head, contact), true).expect("reaches");
            assert!(found.remark.contains(why), "{}", found.remark);
            assert_eq!(found.reaches.len(), 3);
            assert!(found.reaches.iter().all(|r| r.end_m.x > 0.75));
        }
        // Nothing shows that the clustered ends are not on a wall, and the remark says so.
        let found = reaches_to_contact(&recording(false, false), true).expect("reaches");
        let remark = found.remark;
        assert!(remark.contains("closest together"), "{remark}");
    }
}
