//! Detects a hand that rests on a surface.

use super::free_side::FreeSide;
use glam::DVec3;
use hwall_hand::{HandState, WatchConfig};
use hwall_scene::{Hit, Scene, SurfaceId};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct SurfacePlace {
    pub(in crate::predict) surface: SurfaceId,
    pub(in crate::predict) point_m: DVec3,
    /// Unit normal there, on the person's side.
    pub(in crate::predict) normal: DVec3,
}

/// Detects a hand that rests on a surface.
#[derive(Debug, Clone, Default)]
pub(in crate::predict) struct RestWatch {
    /// Displacement over the last decimetre before the hand came to rest, m.
    approach_m: DVec3,
    last_s: Option<f64>,
    place: Option<SurfacePlace>,
}

/// Length over which the direction of approach is measured, m.
const APPROACH_M: f64 = 0.1;

/// Half a finger, m: tracked points lie inside the hand.
const HALF_FINGER_M: f64 = 0.008;

/// A resting hand within this many standard deviations of the registration from a surface is on it.
const REGISTRATION_SDS: f64 = 2.0;

/// Lower bound of the cosine between the approach and the normal: a hand may also slide along a surface.
const LEAST_COS: f64 = 0.05;

/// Hysteresis: a resting hand changes to another surface only if its log probability is higher by this.
const KEPT: f64 = 2.0;

impl RestWatch {
    pub(in crate::predict) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The place that the hand rests on: the point of a surface below it. `side` is the side it came from.
    ///
    /// A slow hand is on a surface that it has passed through, or that is no further away than half a finger plus the registration error. If there
    /// are several, it is on the one with the largest product of the density of the distance and the cosine of the angle of approach. The hand
    /// stays on it until it is as fast as at the onset of a reach or further away than that.
    pub(in crate::predict) fn rest(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        side: &FreeSide,
        registration_sd_m: f64,
        watch: &WatchConfig,
    ) -> Option<SurfacePlace> {
        let step_s = self.last_s.map_or(0.0, |s| (hand.t_s - s).max(0.0));
        self.last_s = Some(hand.t_s);
        let before = self.place.take();
        if before.is_none() {
            let way_m = self.approach_m + hand.velocity_m_per_s * step_s;
            self.approach_m = way_m.clamp_length_max(APPROACH_M);
        }
        // Noise must not end the rest.
        let slow_m_per_s = match before {
            Some(_) => watch.onset_m_per_s,
            None => watch.offset_m_per_s,
        };
        if hand.velocity_m_per_s.length() > slow_m_per_s {
            return None;
        }
        let hand_m = hand.point_m;
        let near_m = HALF_FINGER_M + REGISTRATION_SDS * registration_sd_m;
        let approach = self.approach_m.try_normalize();
        let ahead = approach.and_then(|way| {
            let hit = scene.ray_cast(hand_m - way * near_m, way).ok()??;
            let near = hit.distance_m <= 2.0 * near_m && scene.surface(hit.surface).touchable();
            near.then(|| SurfacePlace::of(&hit))
        });
        let closest = scene.closest_touchable(hand_m, near_m).ok().flatten();
        let closest = closest.map(|c| SurfacePlace {
            surface: c.surface,
            point_m: c.point_m,
            normal: c.normal,
        });
        let through = side.behind.as_ref().map(SurfacePlace::of);
        let same = before.and_then(|place| {
            let c = scene.project_on(place.surface, hand_m).ok()?;
            let point_m = c.point_m;
            (c.distance_m <= near_m).then_some(SurfacePlace { point_m, ..place })
        });
        let log_probability = |place: &SurfacePlace| {
            // A hand that pressed through is on the surface.
            let off_m = (hand_m - place.point_m).dot(place.normal).max(0.0);
            let cos = approach.map_or(1.0, |way| -way.dot(place.normal));
            let kept = before.is_some_and(|b| b.surface == place.surface);
            let sd_m = near_m / 3.0;
            cos.max(LEAST_COS).ln() - 0.5 * (off_m / sd_m).powi(2) + f64::from(kept) * KEPT
        };
        let place = [same, through, ahead, closest]
            .into_iter()
            .flatten()
            .map(|place| place.facing(side.from_m))
            .max_by(|a, b| log_probability(a).total_cmp(&log_probability(b)))?;
        // The point straight below the hand, unless the surface has a hole or ends there.
        self.place = Some(place.below(scene, hand_m).unwrap_or(place));
        self.place
    }
}

/// Rays to a surface start this far in front of it, m: nothing else is that close.
const STAND_OFF_M: f64 = 0.01;

/// The normal or its opposite, whichever points along a direction.
pub(in crate::predict) fn facing(normal: DVec3, along: DVec3) -> DVec3 {
    if along.dot(normal) < 0.0 {
        -normal
    } else {
        normal
    }
}

impl SurfacePlace {
    pub(in crate::predict) fn of(hit: &Hit) -> Self {
        Self {
            surface: hit.surface,
            point_m: hit.point_m,
            normal: hit.normal,
        }
    }

    /// The same place with its normal towards a point.
    pub(in crate::predict) fn facing(self, towards_m: DVec3) -> Self {
        Self {
            normal: facing(self.normal, towards_m - self.point_m),
            ..self
        }
    }

    /// Projection of a point along the normal onto the same surface; `None` if the surface has a hole there or ends.
    pub(in crate::predict) fn below(&self, scene: &Scene, point_m: DVec3) -> Option<Self> {
        let off_m = (point_m - self.point_m).dot(self.normal).abs();
        let from_m = point_m + self.normal * (off_m + STAND_OFF_M);
        let hit = scene.ray_cast(from_m, -self.normal).ok().flatten()?;
        (hit.surface == self.surface).then(|| Self::of(&hit))
    }
}
