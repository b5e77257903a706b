//! At the edge between two surfaces, keeps the board on the surface that it serves if it would be late on the other.

use super::commands::{Control, OVERDUE_S, RESTS_S};
use crate::session::handover::Guidance;
use hwall_haptics::{BoardTarget, QUARTER_TURNS_RAD, board_pose};
use hwall_kinematics::{BranchPolicy, NearestConfig};

/// A motion around an edge to another surface takes this multiple of its least joint time: the board has to back out.
const AROUND: f64 = 1.5;
/// Within this distance of a place, another one may be touched instead, m: a board's width.
const BESIDE_M: f64 = 0.2;

impl Control {
    /// Keeps the served place if the new place is next to it on another surface and cannot be reached before the hand arrives. Predictions
    /// at an edge waver between its surfaces, and a board that leaves for a place it cannot reach in time would be at neither place.
    pub(super) fn stay_if_other_is_too_far(&mut self, now_s: f64, guidance: &mut Guidance) {
        let until_s = self.stays_until_s.take();
        let (Some(last), Some(next), Some(contact_s)) =
            (self.guidance.target, guidance.target, guidance.contact_s)
        else {
            return;
        };
        // Non-finite values are passed on: the arm holds and reports them.
        let is_sound =
            next.normal.is_finite() && next.roll_rad.is_none_or(|roll_rad| roll_rad.is_finite());
        let is_beside = is_sound && last.point_m.distance(next.point_m) <= BESIDE_M;
        let presents = last.behind_m == 0.0 && next.behind_m == 0.0 && self.contact.is_none();
        // A solver that searches is too slow to be called again.
        let is_other_kind = self.guidance.answer.is_some()
            || guidance.answer.is_some()
            || self.renderer.arm().searches();
        // In a world that moved, surfaces are no longer where they were.
        let has_moved = self.guidance.world_moves != guidance.world_moves;
        let is_same_surface = self.guidance.surface == guidance.surface;
        if is_same_surface || has_moved || !is_beside || !presents || is_other_kind {
            return;
        }
        let left_s = self.step.and_then(|step| step.left_s);
        let is_in_time =
            left_s.is_some_and(|left_s| now_s + left_s <= contact_s.max(now_s + RESTS_S));
        let until_s = until_s.unwrap_or(contact_s + OVERDUE_S);
        if is_in_time && now_s <= until_s && now_s + AROUND * self.takes_s(&next) > contact_s {
            self.stays_until_s = Some(until_s);
            guidance.target = Some(BoardTarget {
                stamp_s: next.stamp_s,
                ..last
            });
            (guidance.surface, guidance.roughness) =
                (self.guidance.surface, self.guidance.roughness);
        }
    }

    /// Least time to a target, s: to the configuration from its map, or else the least over all quarter turns; infinite if the arm cannot
    /// hold the target.
    fn takes_s(&mut self, target: &BoardTarget) -> f64 {
        let follower = self.renderer.follower();
        if let Some(near) = &target.near {
            return follower.least_time_to_s(near);
        }
        // No map has the place, for example the top of a shelf.
        let (arm, here) = (follower.arm(), follower.commanded());
        let mut least_s = f64::INFINITY;
        for turn_rad in QUARTER_TURNS_RAD {
            let roll_rad = target.roll_rad.unwrap_or(0.0) + turn_rad;
            let Ok(pose) = board_pose(target.point_m, target.normal, roll_rad) else {
                continue;
            };
            // Searching all branches takes ten times as long, too long for a step.
            let config = NearestConfig {
                policy: BranchPolicy::Keep,
                ..NearestConfig::default()
            };
            if let Ok(solution) = arm.nearest(&pose, &here, &config, &mut self.scratch) {
                least_s = least_s.min(follower.least_time_to_s(&solution.q));
            }
        }
        least_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Session, SessionConfig, Walls};
    use glam::DVec3;
    use hwall_contact::{DeterministicConfig, DeterministicPredictor};
    use hwall_haptics::{ArmState, Board, RenderStep};
    use hwall_kinematics::{JointPositions, JointTorques, JointVelocities, SrsArm};
    use hwall_scene::{Scene, SurfaceId};

    const CONTACT_S: f64 = 0.35;

    const NOW_S: f64 = 0.0;

    /// The board serves a place on a wall, reaches it in `left_s`, and is sent to another place, a quarter turn away. Is the first place
    /// kept?
    fn keeps(left_s: f64, change: impl Fn(&mut Guidance)) -> bool {
        keeps_until(None, left_s, change)
    }

    /// As `keeps`, if the place has been kept before, until `until_s` at the latest.
    fn keeps_until(until_s: Option<f64>, left_s: f64, change: impl Fn(&mut Guidance)) -> bool {
        let obj = "o wall\nv 0.7 -1 0\nv 0.7 1 0\nv 0.7 1 2\nv 0.7 -1 2\nf 1 2 3 4\n";
        let (scene, _) = Scene::from_obj_str(obj, None).expect("a wall");
        let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led());
        let (arm, board) = (SrsArm::iiwa7(), Board::default());
        let (predictor, config) = (predictor.expect("limits"), SessionConfig::default());
        let session = Session::new(&arm, &board, scene, Walls::default(), predictor, config);
        let mut control = session.expect("a session").control;
        let at = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let state = ArmState {
            t_s: 0.0,
            q: at,
            qd: JointVelocities::default(),
            external_torque: Some(JointTorques::default()),
        };
        control.step(0.0, &state);
        let step = control.step.expect("a step");
        control.step = Some(RenderStep {
            left_s: Some(left_s),
            ..step
        });
        let mut turned = at;
        turned[0] += std::f64::consts::FRAC_PI_2;
        let place = |point_m: DVec3, normal: DVec3, near: JointPositions| BoardTarget {
            near: Some(near),
            ..BoardTarget::new(point_m, normal, NOW_S)
        };
        let before = place(DVec3::new(0.7, 0.0, 0.6), DVec3::X, at);
        control.guidance = Guidance {
            target: Some(before),
            surface: Some(SurfaceId(0)),
            contact_s: Some(CONTACT_S),
            ..Guidance::default()
        };
        let mut guidance = Guidance {
            target: Some(place(DVec3::new(0.72, 0.04, 0.6), DVec3::Y, turned)),
            surface: Some(SurfaceId(1)),
            ..control.guidance
        };
        change(&mut guidance);
        control.stays_until_s = until_s;
        control.stay_if_other_is_too_far(NOW_S, &mut guidance);
        guidance.surface == Some(SurfaceId(0))
    }

    #[test]
    fn a_board_that_is_in_time_does_not_leave_for_a_place_round_the_edge_that_it_cannot_reach() {
        assert!(keeps(0.0, |_| {}));
        assert!(keeps(0.3, |_| {}));
        // The board would be late here as well, or in time there.
        assert!(!keeps(0.4, |_| {}));
        assert!(!keeps(0.0, |guidance| guidance.contact_s = Some(3.0)));
        // Not for ever: once the hand is overdue, the new place counts.
        assert!(keeps_until(Some(NOW_S + 0.01), 0.0, |_| {}));
        assert!(!keeps_until(Some(NOW_S - 0.01), 0.0, |_| {}));
        // Not for a place that is far away, in a world that moved, without a target or without a normal.
        let far = |target: &mut BoardTarget| target.point_m.y = 0.5;
        assert!(!keeps(0.0, |g| g.target.iter_mut().for_each(far)));
        assert!(!keeps(0.0, |guidance| guidance.world_moves = 1));
        assert!(!keeps(0.0, |guidance| guidance.target = None));
        let no_normal = |target: &mut BoardTarget| target.normal = DVec3::NAN;
        assert!(!keeps(0.0, |g| g.target.iter_mut().for_each(no_normal)));
        // A place outside the maps goes to the solver: the arm cannot hold the board there with its face towards itself.
        let unknown = |normal: DVec3| {
            move |guidance: &mut Guidance| {
                if let Some(target) = &mut guidance.target {
                    (target.near, target.normal) = (None, normal);
                }
                guidance.contact_s = Some(1.5);
            }
        };
        assert!(keeps(0.0, unknown(DVec3::NEG_X)));
        assert!(!keeps(0.0, unknown(DVec3::X)));
        assert!(!keeps(0.0, |guidance| guidance.contact_s = None));
        assert!(!keeps(0.0, |guidance| guidance.contact_s = Some(f64::NAN)));
    }
}
