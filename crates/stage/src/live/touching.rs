//! The fingertip of a tracked hand on the board of a simulated arm.

use crate::run::simulated_arm::SimulatedArm;
use glam::DVec3;
use hwall::hand::{HandFrame, Tracking};
use hwall::haptics::Board;
use hwall_sim::{HandContact, SimError};

/// Between two samples the fingertip goes on for at most this long, s: a period of a headset and a half.
const AHEAD_S: f64 = 0.02;

/// Presses the board of a simulated arm with a tracked fingertip.
pub(super) struct Touching {
    finger: HandContact,
    arm_s: f64,
}

impl Touching {
    pub(super) fn new(board: &Board) -> Self {
        Self {
            finger: HandContact {
                half_extent_m: board.half_width_m,
                ..HandContact::default()
            },
            arm_s: 0.0,
        }
    }

    /// Moves the arm's clock on to `until_s` and lets the fingertip press the board; returns the force, base axes, N. A hand that is
    /// lost presses nothing.
    pub(super) fn advance(
        &mut self,
        arm: &mut SimulatedArm,
        until_s: f64,
        frame: Option<&HandFrame>,
        tracking: Option<&Tracking>,
    ) -> Result<DVec3, SimError> {
        let dt_s = until_s - self.arm_s;
        if dt_s > 0.0 {
            arm.advance(dt_s)?;
            self.arm_s = until_s;
        }
        let state = tracking.and_then(Tracking::state);
        let tip = state.zip(frame).and_then(|(state, frame)| {
            let ahead_s = (until_s - frame.t_s).clamp(0.0, AHEAD_S);
            let tip_m = frame.contact_point()?.position_m;
            Some((
                tip_m + ahead_s * state.velocity_m_per_s,
                state.velocity_m_per_s,
            ))
        });
        let wrench = match tip {
            Some((tip_m, velocity)) => {
                let relative = velocity - arm.twist().linear_m_per_s;
                self.finger.wrench(&arm.pose(), tip_m, relative)?
            }
            None => None,
        };
        let wrench = wrench.unwrap_or_default();
        arm.apply_wrench(wrench)?;
        Ok(wrench.force_n)
    }
}
