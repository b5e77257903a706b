//! The side of the surfaces that the hand is on, or came from.

use glam::DVec3;
use hwall_hand::HandState;
use hwall_scene::{Hit, Scene};

/// The side of the surfaces that the hand came from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct FreeSide {
    /// The place to look for surfaces from, m.
    pub(in crate::predict) from_m: DVec3,
    /// The surface that the hand has gone through.
    pub(in crate::predict) behind: Option<Hit>,
}

/// Remembers the side from which a hand came to a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::predict) struct SideWatch {
    /// Last place of the hand on the free side of all surfaces, m.
    free_m: Option<DVec3>,
    /// When the hand was seen last, s.
    seen_s: f64,
}

/// How far behind a surface a hand is still taken to touch it from the front, m.
const DEEPEST_M: f64 = 0.25;

/// A hand that was lost for longer than this may be anywhere, s.
const LONGEST_LOSS_S: f64 = 0.5;

/// A hand nearer than this to a surface is on it and not through it, m: rounding.
const ON_SURFACE_M: f64 = 1e-6;

impl SideWatch {
    pub(in crate::predict) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The side of the surfaces that the hand is on, or that it came from when it has gone through one.
    pub(in crate::predict) fn free_side(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        eye_m: Option<DVec3>,
    ) -> FreeSide {
        let hand_m = hand.point_m;
        // Also for a clock that was set back.
        if !(0.0..=LONGEST_LOSS_S).contains(&(hand.t_s - self.seen_s)) {
            self.forget();
        }
        self.seen_s = hand.t_s;
        // What lies between, or under the hand, and which of them.
        let through = |from_m: DVec3| {
            let way = hand_m - from_m;
            let hit = scene.ray_cast(from_m, way).ok()??;
            let beyond_m = way.length() - hit.distance_m;
            let met = beyond_m > -ON_SURFACE_M && scene.surface(hit.surface).touchable();
            met.then_some((hit, beyond_m <= ON_SURFACE_M))
        };
        let met = match (self.free_m, eye_m) {
            (Some(free_m), _) => through(free_m).map(|met| (met, free_m)),
            (None, Some(eye_m)) => through(eye_m).map(|met| (met, met.0.point_m.lerp(eye_m, 1e-3))),
            (None, None) => None,
        };
        match met {
            // On the surface: a rounding behind it is no free side, from which all that is before it would be behind.
            Some(((_, true), free_m)) => {
                self.free_m = Some(free_m);
                FreeSide {
                    from_m: free_m,
                    behind: None,
                }
            }
            // A hand that is deeper went round, or the tracker lost it on the way.
            Some(((hit, false), free_m)) if hit.point_m.distance(hand_m) <= DEEPEST_M => {
                self.free_m = Some(free_m);
                FreeSide {
                    from_m: free_m,
                    behind: Some(hit),
                }
            }
            _ => {
                self.free_m = Some(hand_m);
                FreeSide {
                    from_m: hand_m,
                    behind: None,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::HandPoint;

    /// A hand that goes through a wall, rests within a rounding of its surface on its way back, and comes out.
    #[test]
    fn a_hand_that_comes_back_by_way_of_the_surface_is_on_the_side_it_came_from() {
        let obj = "o wall\nv 0.62 -1 0\nv 0.62 1 0\nv 0.62 1 2\nv 0.62 -1 2\nf 1 2 3 4\n";
        let (scene, _) = Scene::from_obj_str(obj, None).unwrap();
        for off_m in [-5e-7, -5e-8, -1e-16, 0.0, 1e-16, 5e-8, 5e-7] {
            let mut watch = SideWatch::default();
            let mut side_at = |k: usize, x_m: f64| {
                let hand = HandState {
                    t_s: 0.01 * k as f64,
                    point: HandPoint::Index,
                    point_m: DVec3::new(0.62 + x_m, 0.01, 1.0),
                    velocity_m_per_s: DVec3::ZERO,
                    direction: None,
                    smoothed_m: [DVec3::ZERO; 2],
                    delay_s: 0.0,
                    unseen_s: 0.0,
                    palm_m: None,
                };
                watch.free_side(&scene, &hand, None)
            };
            let way_m = [0.1, 0.01, -0.02, -0.05, -0.02, off_m, off_m, 0.01, 0.1];
            let sides: Vec<FreeSide> = way_m
                .iter()
                .enumerate()
                .map(|(k, x_m)| side_at(k, *x_m))
                .collect();
            for (side, x_m) in sides.iter().zip(way_m) {
                assert!(side.from_m.x > 0.62, "{off_m} at {x_m}: {side:?}");
                assert_eq!(side.behind.is_some(), x_m < -2e-6, "{off_m} at {x_m}");
            }
        }
    }
}
