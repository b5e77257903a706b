//! The touches of a run: planned for a simulated person, or found in a recording.

use crate::input::arms::BoardArm;
use crate::input::scene_file::looks_like;
use anyhow::bail;
use glam::{DAffine3, DVec3};
use hwall::reachability::Target;
use hwall_hand::{HandFrame, Reach, Recording};
use hwall_scene::{Facet, Scene, SurfaceId};
use hwall_sim::{PersonConfig, TouchPlan, TouchTruth};
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
    /// The gaze lands on the point, s; `None` if not before the contact, or unknown.
    pub landed_s: Option<f64>,
}

impl Touch {
    /// Where the board must be.
    pub(crate) const fn place(&self) -> Target {
        Target {
            point_m: self.point_m,
            normal: self.normal,
        }
    }
}

/// A person's standing place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The eyes, m.
    pub head_m: DVec3,
    /// The resting hand, m.
    pub hand_m: DVec3,
}

impl Standing {
    /// Of the default person.
    #[must_use]
    pub fn nominal() -> Self {
        let nominal = PersonConfig::default();
        Self {
            head_m: nominal.head_m,
            hand_m: nominal.hand_rest_m,
        }
    }

    /// Where somebody stands in a frame; an untracked head is assumed at the default place above and behind a resting hand.
    /// `None`: no hand.
    #[must_use]
    pub fn seen_in(frame: &HandFrame) -> Option<Self> {
        let nominal = Self::nominal();
        let hand_m = frame.contact_point()?.position_m;
        let assumed_m = hand_m + nominal.head_m - nominal.hand_m;
        Some(Self {
            head_m: frame.head_m.unwrap_or(assumed_m),
            hand_m,
        })
    }
}

/// People touch between the hip and slightly above the eyes; distances from the eyes, m.
const BELOW_EYES_M: f64 = 0.85;
const ABOVE_EYES_M: f64 = 0.3;
/// Largest distance from the resting hand, m: beyond this people would walk.
pub(crate) const FAR_M: f64 = 1.1;

/// Chooses points for a simulated person: surfaces in turn, at least `clear_m` in front of the resting hand, five of six touches within
/// reach.
///
/// # Errors
/// A scene in which too few points are visible and free before the hand.
pub fn plan(
    scene: &Scene,
    arm: &BoardArm,
    places: &Standing,
    clear_m: f64,
    count: usize,
    seed: u64,
) -> anyhow::Result<Vec<TouchPlan>> {
    let Standing { head_m, hand_m } = *places;
    let mut sampler = Sampler::new(seed);
    let patches: Vec<Facet> = scene.vertical_facets();
    if patches.is_empty() {
        bail!(
            "the scene has no vertical surface that can be touched ({})",
            looks_like(scene)
        );
    }
    let mut plans = Vec::new();
    for i in 0..count {
        let want_reachable = i % 6 != 5;
        let found = (0..20_000).find_map(|attempt| {
            // Surfaces in turn; a surface without a suitable point is skipped after 200 attempts.
            let patch = &patches[(i + attempt / 200) % patches.len()];
            let point_m = inside(patch, &mut sampler)?;
            let normal = facing(patch.normal, head_m - point_m);
            let suits = at_hand(places, point_m)
                && (hand_m - point_m).dot(normal) >= clear_m
                // The outline of a facet encloses its holes.
                && scene.closest_touchable(point_m, ON_SURFACE_M).ok()?.is_some()
                && arm.unreachable(point_m, normal).ok()?.is_none() == want_reachable
                && scene.visible(head_m, point_m + normal * 0.01).ok()?
                && scene.visible(hand_m, point_m + normal * 0.05).ok()?;
            suits.then_some(TouchPlan {
                target_m: point_m,
                normal,
            })
        });
        match found {
            Some(plan) => plans.push(plan),
            // A scene entirely within reach is accepted.
            None if !want_reachable => {}
            None => bail!(
                "found no free point within the arm's reach on the scene's vertical surfaces ({})",
                looks_like(scene)
            ),
        }
    }
    Ok(plans)
}

/// Is a point near enough to touch, and at a height where people touch things?
pub(crate) fn at_hand(places: &Standing, point_m: DVec3) -> bool {
    let Standing { head_m, hand_m } = *places;
    point_m.distance(hand_m) < FAR_M
        && (head_m.z - BELOW_EYES_M..head_m.z + ABOVE_EYES_M).contains(&point_m.z)
}

/// A point this near to a surface is on it, m.
const ON_SURFACE_M: f64 = 1e-3;

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
        landed_s: t.landed_s,
    };
    truths.iter().map(touch).collect()
}

/// The touches in a recording: where each reach first crosses a touchable surface, or the
/// surface near its end.
///
/// # Errors
/// Geometry that the scene refuses.
pub fn of_recording(
    scene: &Scene,
    recording: &Recording,
    base_from_hand: DAffine3,
    contacts: &[Reach],
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
            landed_s: None,
        });
    }
    Ok(touches)
}

/// A path that ends within this distance of a surface has touched it, m: a tracked tip is a point inside
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

/// A random point of a facet, a hand's breadth inside its outline.
pub(super) fn inside(patch: &Facet, sampler: &mut Sampler) -> Option<DVec3> {
    const EDGE_M: f64 = 0.08;
    let low = patch.outline_m.iter().copied().reduce(DVec3::min)?;
    let high = patch.outline_m.iter().copied().reduce(DVec3::max)?;
    let drawn = sampler.point_in_box(low, high);
    let point = drawn - patch.normal * (drawn - patch.point_m).dot(patch.normal);
    within(patch, point, EDGE_M).then_some(point)
}

/// Is a point of the facet's plane at least this far inside its outline?
#[must_use]
pub fn within(patch: &Facet, point_m: DVec3, edge_m: f64) -> bool {
    let n = patch.outline_m.len();
    (0..n).all(|i| {
        let (a, b) = (patch.outline_m[i], patch.outline_m[(i + 1) % n]);
        let inward = patch.normal.cross(b - a).normalize_or_zero();
        (point_m - a).dot(inward) >= edge_m
    })
}

pub(crate) fn facing(normal: DVec3, towards: DVec3) -> DVec3 {
    if normal.dot(towards) < 0.0 {
        -normal
    } else {
        normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_haptics::Board;

    #[test]
    fn nobody_touches_the_hole_in_a_wall() {
        // A window of half a metre in a wall of 1.2 m by 1 m.
        let corners = |half_y: f64, [z0, z1]: [f64; 2]| {
            [[-half_y, z0], [half_y, z0], [half_y, z1], [-half_y, z1]]
                .map(|[y, z]| format!("v 0.62 {y} {z}\n"))
                .concat()
        };
        let (outer, inner) = (corners(0.6, [0.2, 1.2]), corners(0.25, [0.45, 0.95]));
        let faces = "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
        let obj = format!("o wall\n{outer}{inner}{faces}");
        let (scene, _) = Scene::from_obj_str(&obj, None).unwrap();
        assert_eq!(scene.vertical_facets().len(), 1);
        let arm = BoardArm::named("iiwa7", &Board::default()).unwrap();
        let plans = plan(&scene, &arm, &Standing::nominal(), f64::NEG_INFINITY, 48, 3).unwrap();
        for plan in &plans {
            let [y, z] = [plan.target_m.y, plan.target_m.z];
            assert!(y.abs() >= 0.25 || !(0.45..=0.95).contains(&z), "{y} {z}");
        }
        assert!(plans.len() >= 40, "{}", plans.len());
    }

    #[test]
    fn a_person_without_a_tracked_head_stands_behind_the_hand() {
        let nominal = Standing::nominal();
        let mut frame = HandFrame::empty(0.0);
        assert_eq!(Standing::seen_in(&frame), None);
        frame.palm_m = Some(nominal.hand_m + DVec3::Y);
        let seen = Standing::seen_in(&frame).unwrap();
        assert!(seen.head_m.distance(nominal.head_m + DVec3::Y) < 1e-12);
        frame.head_m = Some(DVec3::ONE);
        assert_eq!(Standing::seen_in(&frame).unwrap().head_m, DVec3::ONE);
    }
}
