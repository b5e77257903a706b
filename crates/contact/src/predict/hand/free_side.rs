//! The side of a surface that the hand is on, or came from.

use glam::DVec3;
use hwall_hand::HandState;
use hwall_scene::{Hit, Scene};

/// The side of the surfaces that the hand came from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct FreeSide {
    /// Point from which to search for surfaces, m.
    pub(in crate::predict) from_m: DVec3,
    /// The surface that the hand has passed through.
    pub(in crate::predict) behind: Option<Hit>,
}

/// Tracks the side from which a hand came to a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::predict) struct SideWatch {
    /// Last position of the hand on the free side of all surfaces, m.
    free_m: Option<DVec3>,
    /// Time of the last sample, s.
    seen_s: f64,
}

/// Largest depth behind a surface at which the hand is still taken to touch it from the front, m.
const DEEPEST_M: f64 = 0.25;

/// Longest loss of the hand after which its last position still counts, s.
const LONGEST_LOSS_S: f64 = 0.5;

/// A hand beside the edge of a surface and near its plane is on either side of it, depending on the error of the tracker and of the
/// registration. It touches the side that the person sees, so surfaces are searched for from a point this far towards the eye, m.
const TOWARDS_EYE_M: f64 = 0.05;

/// A hand nearer than this to a surface is on it, not through it, m: rounding.
const ON_SURFACE_M: f64 = 1e-6;

impl SideWatch {
    pub(in crate::predict) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The side of the surfaces that the hand is on, or came from if it has passed through one.
    pub(in crate::predict) fn free_side(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        eye_m: Option<DVec3>,
    ) -> FreeSide {
        let hand_m = hand.point_m;
        // Also after a clock reset.
        if !(0.0..=LONGEST_LOSS_S).contains(&(hand.t_s - self.seen_s)) {
            self.forget();
        }
        self.seen_s = hand.t_s;
        let mut is_on = false;
        let mut through = |from_m: DVec3| {
            let way = hand_m - from_m;
            let hit = scene.ray_cast(from_m, way).ok()??;
            let beyond_m = way.length() - hit.distance_m;
            let touchable = scene.surface(hit.surface).touchable();
            is_on = touchable && beyond_m.abs() <= ON_SURFACE_M;
            (touchable && beyond_m > ON_SURFACE_M).then_some(hit)
        };
        let behind = match (self.free_m, eye_m) {
            (Some(free_m), _) => through(free_m).map(|hit| (hit, free_m)),
            (None, Some(eye_m)) => through(eye_m).map(|hit| (hit, hit.point_m.lerp(eye_m, 1e-3))),
            (None, None) => None,
        };
        match behind {
            // A deeper hand went round the surface, or was lost on its path.
            Some((hit, free_m)) if hit.point_m.distance(hand_m) <= DEEPEST_M => {
                self.free_m = Some(free_m);
                FreeSide {
                    from_m: free_m,
                    behind: Some(hit),
                }
            }
            _ => {
                // On a surface, rounding decides the side, so keep the side the hand came from. If a position behind the surface were taken as
                // free, the sides would stay swapped until the hand is far away.
                let from_m = eye_m.map_or(hand_m, |eye_m| towards(scene, hand_m, eye_m));
                self.free_m = self.free_m.filter(|_| is_on).or(Some(from_m));
                FreeSide {
                    from_m,
                    behind: None,
                }
            }
        }
    }
}

/// The point [`TOWARDS_EYE_M`] from the hand towards the eye, or the hand if a surface is between them.
fn towards(scene: &Scene, hand_m: DVec3, eye_m: DVec3) -> DVec3 {
    let way = (eye_m - hand_m).clamp_length_max(TOWARDS_EYE_M);
    let is_free = |hit: Option<Hit>| hit.is_none_or(|hit| hit.distance_m > way.length());
    match scene.ray_cast(hand_m, way) {
        Ok(hit) if is_free(hit) => hand_m + way,
        _ => hand_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recorded hand came back through a wall with one sample 50 nm behind its front. That sample was taken as free, and from then on the hand
    /// counted as behind the wall everywhere.
    #[test]
    fn a_hand_in_the_plane_of_a_surface_stays_on_its_side() {
        let wall = "o wall\nv 0.5 -1 0\nv 0.5 1 0\nv 0.5 1 2\nv 0.5 -1 2\nf 1 2 3 4\n";
        let (scene, _) = Scene::from_obj_str(wall, None).expect("a wall");
        let mut watch = SideWatch::default();
        let depths_m = [-0.02, -0.01, 0.01, 0.02, 0.01, 5e-8, -0.01, -0.02, -0.1];
        for (depth_m, sample) in depths_m.into_iter().zip(0..) {
            let point_m = DVec3::new(0.5 + depth_m, 0.0, 1.0);
            let hand = super::super::resting_at(point_m, 0.01 * f64::from(sample));
            let side = watch.free_side(&scene, &hand, None);
            assert_eq!(side.behind.is_some(), depth_m > 1e-6, "{depth_m}");
        }
    }

    /// A recorded finger came down to a panel from above, 5 mm behind its plane, while the eyes were in front.
    #[test]
    fn a_hand_beside_an_edge_touches_the_side_that_the_eyes_see() {
        let panel = "o panel\nv 0.5 -0.2 0\nv 0.5 0.2 0\nv 0.5 0.2 1\nv 0.5 -0.2 1\nf 1 2 3 4\n";
        let (scene, _) = Scene::from_obj_str(panel, None).expect("a panel");
        let from_m = |hand_m: DVec3, eye_m: Option<DVec3>| {
            let hand = super::super::resting_at(hand_m, 0.0);
            SideWatch::default().free_side(&scene, &hand, eye_m).from_m
        };
        let (above_m, eye_m) = (DVec3::new(0.505, 0.0, 1.1), DVec3::new(0.2, 0.0, 1.5));
        assert!(from_m(above_m, Some(eye_m)).x < 0.5);
        assert_eq!(from_m(above_m, None), above_m);
        // A hand clearly behind the plane, or hidden by the panel, counts as behind.
        assert!(from_m(DVec3::new(0.6, 0.0, 1.1), Some(eye_m)).x > 0.5);
        let hidden_m = DVec3::new(0.501, 0.0, 0.5);
        assert_eq!(from_m(hidden_m, None), hidden_m);
        for beside in [above_m, DVec3::NAN] {
            assert_eq!(from_m(above_m, Some(beside)), above_m);
        }
        // It comes down behind the edge: it touches the front.
        let mut watch = SideWatch::default();
        let mut side = |z: f64, t_s: f64| {
            let hand = super::super::resting_at(DVec3::new(0.505, 0.0, z), t_s);
            watch.free_side(&scene, &hand, Some(eye_m))
        };
        assert_eq!(side(1.01, 0.0).behind, None);
        let below = side(0.98, 0.01);
        assert!(below.behind.is_some() && below.from_m.x < 0.5);
    }
}
