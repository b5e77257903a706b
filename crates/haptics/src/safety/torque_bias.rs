//! What torque sensors say while nobody can touch the board.

use super::motion_guard::GuardLimits;
use crate::arm::ArmState;
use crate::error::HapticsError;
use hwall_kinematics::{JointTorques, MOST_JOINTS};
use hwall_numeric::check::{non_negative, positive};

/// How the bias of the torque sensors is found, and how much of it is borne.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasConfig {
    /// Largest bias, as a share of the largest torque of its joint; default 0.1 (17.6 N m at the shoulder of an iiwa 7, 4 N m at its wrist).
    /// More hides a touch, or is taken for one.
    pub most_share: f64,
    /// Joints slower than this rest, rad/s; default 0.02.
    pub rest_rad_per_s: f64,
    /// So long must the arm rest and the board be out of reach, s; default 0.5.
    pub rest_s: f64,
    /// Time constant of the estimate, s; default 0.3.
    pub filter_s: f64,
}

impl Default for BiasConfig {
    fn default() -> Self {
        Self {
            most_share: 0.1,
            rest_rad_per_s: 0.02,
            rest_s: 0.5,
            filter_s: 0.3,
        }
    }
}

impl BiasConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("most_share", self.most_share)?;
        positive("rest_rad_per_s", self.rest_rad_per_s)?;
        non_negative("rest_s", self.rest_s)?;
        non_negative("filter_s", self.filter_s)?;
        Ok(())
    }
}

/// Averages external torques while the arm rests and the board is out of everybody's reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct TorqueBias {
    config: BiasConfig,
    /// For how long so far, s.
    rested_s: f64,
    bias: Option<JointTorques>,
}

impl TorqueBias {
    pub(super) const fn new(config: BiasConfig) -> Self {
        Self {
            config,
            rested_s: 0.0,
            bias: None,
        }
    }

    /// As of the last rest, N m.
    pub(super) const fn bias(&self) -> Option<JointTorques> {
        self.bias
    }

    /// One cycle; states are finite. `out_of_reach`: nobody can touch the board.
    pub(super) fn step(&mut self, state: &ArmState, out_of_reach: bool, dt_s: f64) {
        let slow = |qd: &f64| qd.abs() <= self.config.rest_rad_per_s;
        let torque = state
            .external_torque
            .filter(|_| out_of_reach && state.qd.0.iter().all(slow));
        let Some(torque) = torque else {
            self.rested_s = 0.0;
            return;
        };
        self.rested_s += dt_s;
        // Until then what it says may be an echo of the motion.
        if self.rested_s < self.config.rest_s {
            return;
        }
        let Some(bias) = &mut self.bias else {
            self.bias = Some(torque);
            return;
        };
        let share = match self.config.filter_s > 0.0 {
            true => -(-dt_s / self.config.filter_s).exp_m1(),
            false => 1.0,
        };
        for joint in 0..MOST_JOINTS {
            bias[joint] += share * (torque[joint] - bias[joint]);
        }
    }

    /// The first joint whose bias is more than is borne, and the bias, N m.
    pub(super) fn beyond(&self, joints: usize, limits: &GuardLimits) -> Option<(usize, f64)> {
        let bias = self.bias?;
        (0..joints.min(MOST_JOINTS))
            .find(|i| bias[*i].abs() > self.config.most_share * limits.torque_n_m[*i])
            .map(|i| (i, bias[i]))
    }
}
