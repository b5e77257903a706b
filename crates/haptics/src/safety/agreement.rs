//! Do the first states of an arm agree with each other?

use super::motion_guard::GuardLimits;
use crate::arm::ArmState;
use hwall_kinematics::{JointPositions, MOST_JOINTS};

/// States may differ by this beyond what joints turn meanwhile, rad.
const SAME_RAD: f64 = 0.02;

/// Counts states that agree with the one before. A single one may be wrong by any amount, and a command that starts from it would send
/// the arm there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Agreement {
    last: Option<(JointPositions, f64)>,
    count: u32,
}

impl Agreement {
    /// How many states in a row agree, this one included; the same state again does not count.
    pub(super) fn step(&mut self, joints: usize, state: &ArmState, limits: &GuardLimits) -> u32 {
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
        let agrees = dt_s >= 0.0
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
