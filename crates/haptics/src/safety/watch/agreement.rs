//! Do the first states of an arm agree with each other?

use crate::arm::ArmState;
use crate::safety::limits::motion_guard::GuardLimits;
use hwall_kinematics::{JointPositions, MOST_JOINTS};

/// States may differ by this plus the distance that a joint can turn meanwhile, rad.
const SAME_RAD: f64 = 0.02;
/// States further apart in time than this cannot confirm each other, s: a joint may have moved anywhere.
const TOGETHER_S: f64 = 0.1;

/// Counts consecutive states that agree. A single state may be wrong by any amount, and a command that starts from it would send the arm there.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct Agreement {
    last: Option<(JointPositions, f64)>,
    count: u32,
}

impl Agreement {
    /// Number of consecutive agreeing states, including this one; a repeated state does not count.
    pub(in crate::safety) fn step(
        &mut self,
        joints: usize,
        state: &ArmState,
        limits: &GuardLimits,
    ) -> u32 {
        let sound = state.t_s.is_finite()
            && state.q.0.iter().all(|v| v.is_finite())
            && limits.check_state(joints, state).is_ok();
        if !sound {
            (self.last, self.count) = (None, 0);
            return 0;
        }
        let Some((q, t_s)) = self.last else {
            (self.last, self.count) = (Some((state.q, state.t_s)), 1);
            return 1;
        };
        let dt_s = state.t_s - t_s;
        if dt_s == 0.0 && q == state.q {
            return self.count;
        }
        let agrees = dt_s > 0.0
            && dt_s <= TOGETHER_S
            && (0..MOST_JOINTS).all(|i| {
                let most_rad = SAME_RAD + limits.velocity_rad_per_s[i] * dt_s;
                (state.q[i] - q[i]).abs() <= most_rad
            });
        self.last = Some((state.q, state.t_s));
        self.count = if agrees {
            self.count.saturating_add(1)
        } else {
            1
        };
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_kinematics::SrsArm;

    /// The count for a sequence of states (time, s, and angle of joint 2, rad).
    fn counted(states: &[(f64, f64)]) -> u32 {
        let limits = GuardLimits::of_arm(&SrsArm::iiwa7());
        let mut agreement = Agreement::default();
        let mut last = 0;
        for (t_s, q_rad) in states {
            let mut state = ArmState {
                t_s: *t_s,
                q: JointPositions::default(),
                qd: hwall_kinematics::JointVelocities::default(),
                external_torque: None,
            };
            state.q[1] = *q_rad;
            last = agreement.step(7, &state, &limits);
        }
        last
    }

    #[test]
    fn a_state_wrong_in_angle_and_time_does_not_agree() {
        assert_eq!(counted(&[(1.0, 0.0), (1.001, 0.001), (1.002, 0.002)]), 3);
        // Joint 2 turns 1 rad in 0.6 s at its full speed.
        for t_s in [1.6, 2.0, 1000.0] {
            assert_eq!(counted(&[(1.0, 0.0), (t_s, 1.0)]), 1, "{t_s} s");
        }
        assert_eq!(counted(&[(1.0, 0.0), (1.101, 0.0)]), 1);
        // Two different states with one time stamp.
        assert_eq!(counted(&[(1.0, 0.0), (1.0, 0.01)]), 1);
        assert_eq!(counted(&[(1.0, 0.0), (0.999, 0.0)]), 1);
        // A repeated state changes nothing.
        assert_eq!(counted(&[(1.0, 0.0), (1.001, 0.0), (1.001, 0.0)]), 2);
    }
}
