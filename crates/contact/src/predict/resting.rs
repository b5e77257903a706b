//! Where the hand stands to the surfaces: before them all, through one, or at rest on one.

use glam::DVec3;
use hwall_hand::{HandState, WatchConfig};
use hwall_scene::{Hit, Scene, SurfaceId};

/// A surface on which the hand rests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touched {
    pub(crate) surface: SurfaceId,
    /// The point of the surface below the hand, m, and the unit normal there, on the person's side.
    pub(crate) point_m: DVec3,
    pub(crate) normal: DVec3,
}

/// Follows the hand on the free side of the surfaces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standing {
    /// Last place of the hand on the free side of all surfaces, m.
    free_m: Option<DVec3>,
    /// The way of the hand over its last decimetre before it came to rest on something, m.
    approach_m: DVec3,
    last_s: Option<f64>,
    touched: Option<Touched>,
}

/// How far behind a surface a hand is still taken to touch it from the front, m.
const DEEPEST_M: f64 = 0.25;

/// A hand within this of a surface is on it and not through it, m: rounding.
const ON_SURFACE_M: f64 = 1e-6;

/// The direction of an approach is that of this much of the way, m.
const APPROACH_M: f64 = 0.1;

/// Half a finger, m: tracked points lie inside the hand.
const HALF_FINGER_M: f64 = 0.008;

/// Errors of registration within which a hand at rest beside a surface is on it, sds.
const REGISTRATION_SDS: f64 = 2.0;

/// Cosine that a face along the way is credited with at least: hands slide.
const LEAST_COS: f64 = 0.05;

/// Logarithm of how much more probable another surface must be before a resting hand is on that one.
const KEPT: f64 = 2.0;

impl Standing {
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The place to look for surfaces from, m, and the surface that the hand has gone through.
    pub(crate) fn free_side(
        &mut self,
        scene: &Scene,
        hand_m: DVec3,
        eye_m: Option<DVec3>,
    ) -> (DVec3, Option<Hit>) {
        let through = |from_m: DVec3| {
            let way = hand_m - from_m;
            let hit = scene.ray_cast(from_m, way).ok()??;
            let before = hit.distance_m < way.length() - ON_SURFACE_M;
            (before && scene.surface(hit.surface).touchable()).then_some(hit)
        };
        let behind = match (self.free_m, eye_m) {
            (Some(free_m), _) => through(free_m).map(|hit| (hit, free_m)),
            (None, Some(eye_m)) => through(eye_m).map(|hit| (hit, hit.point_m.lerp(eye_m, 1e-3))),
            (None, None) => None,
        };
        match behind {
            // Deeper than this the hand went round, or the tracker lost it on the way.
            Some((hit, free_m)) if hit.point_m.distance(hand_m) <= DEEPEST_M => {
                self.free_m = Some(free_m);
                (free_m, Some(hit))
            }
            _ => {
                self.free_m = Some(hand_m);
                (hand_m, None)
            }
        }
    }

    /// The surface that the hand rests on, if it does. `free_m` and `behind` are those of
    /// [`free_side`](Self::free_side).
    ///
    /// A slow hand is on a surface that it has gone through, or that is no further than half a finger and
    /// what the registration may be wrong by. Of several the one with the best product of the
    /// density of its distance and of the cosine of the angle at which the hand came. It stays on it
    /// until it is as fast as at the onset of a reach or further away than that.
    pub(crate) fn rest(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        (free_m, behind): (DVec3, Option<Hit>),
        calibration_sd_m: f64,
        watch: &WatchConfig,
    ) -> Option<Touched> {
        let step_s = self.last_s.map_or(0.0, |s| (hand.t_s - s).max(0.0));
        self.last_s = Some(hand.t_s);
        let before = self.touched.take();
        if before.is_none() {
            let way_m = self.approach_m + hand.velocity_m_per_s * step_s;
            self.approach_m = way_m.clamp_length_max(APPROACH_M);
        }
        // Noise must not lift it off.
        let slow_m_per_s = match before {
            Some(_) => watch.onset_m_per_s,
            None => watch.offset_m_per_s,
        };
        if hand.velocity_m_per_s.length() > slow_m_per_s {
            return None;
        }
        let hand_m = hand.point_m;
        let near_m = HALF_FINGER_M + REGISTRATION_SDS * calibration_sd_m;
        let approach = self.approach_m.try_normalize();
        let ahead = approach.and_then(|way| {
            let hit = scene.ray_cast(hand_m - way * near_m, way).ok()??;
            let near = hit.distance_m <= 2.0 * near_m && scene.surface(hit.surface).touchable();
            near.then_some((hit.surface, hit.point_m, hit.normal))
        });
        let closest = scene.closest_touchable(hand_m, near_m).ok().flatten();
        let closest = closest.map(|c| (c.surface, c.point_m, c.normal));
        let through = behind.map(|hit| (hit.surface, hit.point_m, hit.normal));
        let same = before.and_then(|t| {
            let c = scene.project_on(t.surface, hand_m).ok()?;
            let near = c.distance_m <= near_m;
            near.then_some((t.surface, c.point_m, t.normal))
        });
        let candidates = [same, through, ahead, closest];
        let log_probability = |(surface, point_m, normal): &(SurfaceId, DVec3, DVec3)| {
            // A hand that pressed through is on the surface.
            let off_m = (hand_m - *point_m).dot(*normal).max(0.0);
            let cos = approach.map_or(1.0, |way| -way.dot(*normal));
            let kept = before.is_some_and(|t| t.surface == *surface);
            let sd_m = near_m / 3.0;
            cos.max(LEAST_COS).ln() - 0.5 * (off_m / sd_m).powi(2) + f64::from(kept) * KEPT
        };
        let (surface, point_m, normal) = candidates
            .into_iter()
            .flatten()
            .map(|(surface, point_m, normal)| {
                let towards = (free_m - point_m).dot(normal);
                (
                    surface,
                    point_m,
                    if towards < 0.0 { -normal } else { normal },
                )
            })
            .max_by(|a, b| log_probability(a).total_cmp(&log_probability(b)))?;
        // Straight below the hand, where the surface has no hole or end there.
        let below_m = onto(scene, surface, hand_m, (point_m, normal));
        let (point_m, normal) = below_m.unwrap_or((point_m, normal));
        self.touched = Some(Touched {
            surface,
            point_m,
            normal,
        });
        self.touched
    }
}

/// A surface is looked for from this far before it, m: nothing else stands that close.
const STAND_OFF_M: f64 = 0.01;

/// A point brought straight onto a surface near a plane through `on_m`, and the normal there; `None`
/// where the surface has a hole or an end.
pub(crate) fn onto(
    scene: &Scene,
    surface: SurfaceId,
    point_m: DVec3,
    (on_m, normal): (DVec3, DVec3),
) -> Option<(DVec3, DVec3)> {
    let off_m = (point_m - on_m).dot(normal).abs();
    let from_m = point_m + normal * (off_m + STAND_OFF_M);
    let hit = scene.ray_cast(from_m, -normal).ok().flatten()?;
    (hit.surface == surface).then_some((hit.point_m, hit.normal))
}
