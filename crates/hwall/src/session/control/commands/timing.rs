//! Whether the board or the hand arrives first, and how that changes the target.

use super::{Control, OVERDUE_S, RESTS_S, SOON_S};
use crate::session::control::state::SessionState;
use hwall_haptics::{ArmState, BoardTarget};

/// A board that arrives more than this after the expected contact is late, s. Smaller differences are within the error of the prediction.
const LATE_S: f64 = 0.2;
/// A face within this distance and angle of its surface is on it, m and rad.
const ON_SURFACE_M: f64 = 0.01;
const ON_SURFACE_RAD: f64 = 0.1;
/// Time to correct the goal by a small distance during the motion, s.
const MOVES_ON_S: f64 = 0.15;
/// A face also serves a touch this far outside the area that counts as in place, m.
const EDGE_M: f64 = 0.005;
/// A goal within this distance of a target's plane is on it, m.
const SAME_PLANE_M: f64 = 1e-3;
/// A board with less motion time left than this is slow and continues, s.
const SLOW_S: f64 = 0.2;

impl Control {
    /// The slack of a target. If there is no time to correct the goal before the hand arrives, the whole face is slack: a goal that covers
    /// the touch is better than one that is reached too late.
    pub(super) fn slack_m(&self, now_s: f64, target: &BoardTarget) -> [f64; 2] {
        let left_s = self.step.and_then(|step| step.left_s);
        let (Some(contact_s), Some(left_s)) = (self.guidance.contact_s, left_s) else {
            return target.slack_m;
        };
        let has_time = contact_s - now_s > left_s + MOVES_ON_S;
        let Some(goal) = self.renderer.follower().goal().filter(|_| !has_time) else {
            return target.slack_m;
        };
        // An overdue hand leaves enough time.
        if now_s > contact_s + OVERDUE_S {
            return target.slack_m;
        }
        let half_m = self.board.half_width_m.min(self.board.half_height_m);
        let widest_m = half_m - self.in_place.inset_m - EDGE_M;
        let off_m = self.renderer.arm().forward(&goal).position_m() - target.point_m;
        let holds = off_m.length() <= widest_m && off_m.dot(target.normal).abs() <= SAME_PLANE_M;
        match holds {
            // A target without slack is too uncertain to keep the goal.
            true => target.slack_m.map(|slack_m| match slack_m > 0.0 {
                true => slack_m.max(widest_m),
                false => slack_m,
            }),
            false => target.slack_m,
        }
    }

    /// The slack within which the goal may move to a place that the board reaches sooner, m; `None` unless the hand is expected
    /// before the board.
    pub(super) fn sooner_within_m(&self, now_s: f64, target: &BoardTarget) -> Option<[f64; 2]> {
        let left_s = self.step?.left_s?;
        let due_s = self.guidance.contact_s?;
        let is_free = target.slack_m.iter().all(|m| *m > 0.0);
        let is_first = self.contact.is_none() && hand_is_first(now_s, due_s, left_s);
        (is_free && is_first).then_some(target.slack_m)
    }

    /// Will the hand clearly arrive before the board?
    pub(super) fn will_be_late(&self, now_s: f64, state: &ArmState) -> bool {
        let (Some(target), Some(contact_s)) = (self.guidance.target, self.guidance.contact_s)
        else {
            return false;
        };
        let left_s = self.step.and_then(|step| step.left_s);
        let presents = target.behind_m == 0.0 && self.contact.is_none();
        // A board on its surface does not go back for a small correction.
        let face = self.renderer.arm().forward(&state.q);
        let off_m = face.position_m() - target.point_m;
        let is_on_surface = off_m.length() <= self.board.half_width_m
            && off_m.dot(target.normal).abs() <= ON_SURFACE_M
            && face.rotation().z_axis.angle_between(target.normal) <= ON_SURFACE_RAD;
        let is_there = self.state == SessionState::InPlace || is_on_surface;
        let near = contact_s - now_s <= SOON_S;
        let is_late = |left_s: f64| left_s > SLOW_S && now_s + left_s > contact_s + LATE_S;
        presents && !is_there && near && left_s.is_some_and(is_late)
    }
}

/// Does a hand that is due at `due_s` arrive before a board that needs `left_s`? A board at rest is not late, and an overdue hand may
/// not come at all.
fn hand_is_first(now_s: f64, due_s: f64, left_s: f64) -> bool {
    now_s <= due_s + OVERDUE_S && (due_s - now_s).max(RESTS_S) < left_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_first_while_it_comes_and_the_board_is_under_way() {
        for (due_s, left_s, is_first) in [
            (10.2, 0.5, true),
            (10.5, 0.2, false),
            // The hand is overdue, then overdue for too long.
            (9.9, 0.5, true),
            (9.9 - OVERDUE_S, 0.5, false),
            // The board rests, or nearly.
            (9.9, 0.0, false),
            (9.9, RESTS_S, false),
            // Unknown times.
            (f64::NAN, 0.5, false),
            (10.2, f64::NAN, false),
        ] {
            assert_eq!(
                hand_is_first(10.0, due_s, left_s),
                is_first,
                "{due_s} {left_s}"
            );
        }
    }
}
