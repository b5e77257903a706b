//! Joint and workspace limits of commands and of the measured state.

use crate::arm::ArmState;
use crate::error::HapticsError;
use crate::safety::state::{Channel, SafeReason};
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointLimit, JointPositions, JointTorques, MOST_JOINTS};
use hwall_numeric::check::{all_finite, non_negative, positive, that};

/// A box, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkspaceBox {
    /// Least corner, m.
    pub min_m: DVec3,
    /// Greatest corner, m.
    pub max_m: DVec3,
}

impl WorkspaceBox {
    /// Is the point inside? NaN is not.
    #[must_use]
    pub fn contains(&self, point_m: DVec3) -> bool {
        self.min_m.cmple(point_m).all() && point_m.cmple(self.max_m).all()
    }

    /// Rejects NaN, infinity and corners in the wrong order.
    ///
    /// # Errors
    /// The first of these.
    pub fn validate(&self) -> Result<(), HapticsError> {
        all_finite("min_m", &self.min_m.to_array())?;
        all_finite("max_m", &self.max_m.to_array())?;
        let size = self.max_m - self.min_m;
        that(
            size.min_element() > 0.0,
            "size of the workspace",
            size.min_element(),
            "positive",
        )?;
        Ok(())
    }
}

/// Joint limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardLimits {
    /// Commanded angles stay within, rad.
    pub position: [JointLimit; MOST_JOINTS],
    /// Commanded speeds stay within, rad/s.
    pub velocity_rad_per_s: [f64; MOST_JOINTS],
    /// Largest acceleration when a command is cut or catches up, rad/s²; default that of the iiwa 7.
    pub acceleration_rad_per_s2: [f64; MOST_JOINTS],
    /// Commanded torques (beyond gravity) and external torques stay within, N m.
    pub torque_n_m: [f64; MOST_JOINTS],
    /// Commanded torques change no faster, N m/s; default 1000 (1 N m per ms).
    pub torque_rate_n_m_per_s: f64,
    /// The measured angle may be this much beyond its limit, rad; default 0.01.
    pub position_slack_rad: f64,
    /// The measured speed may be this share above its limit; default 0.2.
    pub velocity_slack: f64,
    /// A commanded position further from the last one than this (any joint) is a jump, not a motion, rad; default 0.5.
    pub leap_rad: f64,
    /// The centre of the face stays inside; `None`: anywhere.
    pub workspace: Option<WorkspaceBox>,
}

/// An unknown torque limit is the torque of this force at the joint's longest lever, N: the force limit for a pressed hand (ISO/TS 15066, table A.2).
/// A larger torque near a person is a fault.
const PRESSED_HAND_N: f64 = 140.0;
/// A hand may press this far from the tool point, m.
const BESIDE_TOOL_M: f64 = 0.1;
/// Number of postures tried for the longest lever.
const POSTURES: u32 = 64;

/// Largest distance of the tool point from each joint axis, m, over evenly distributed postures; 1 for a sliding joint.
fn longest_levers_m(arm: &dyn ArmKinematics) -> [f64; MOST_JOINTS] {
    let mut levers_m = [0.0_f64; MOST_JOINTS];
    for posture in 0..POSTURES {
        let q = JointPositions::spread(arm.limits(), posture);
        for (lever_m, linear) in levers_m.iter_mut().zip(arm.jacobian(&q).linear) {
            *lever_m = lever_m.max(linear.length());
        }
    }
    levers_m
}

const fn beyond(channel: Channel, joint: usize, value: f64) -> Result<(), SafeReason> {
    Err(SafeReason::JointLimit {
        channel,
        joint,
        value,
    })
}

impl GuardLimits {
    /// The arm's own limits of angle, speed, torque and acceleration. An unknown torque limit is the torque of 140 N at the joint's longest
    /// lever plus 0.1 m. A stated one is cut to four times that, and to twice that of the longest lever of the arm. A sliding joint counts as a lever
    /// of 1 m. Unknown accelerations are an iiwa 7's
    /// ([`ArmKinematics::accelerations_or`]).
    #[must_use]
    pub fn of_arm(arm: &dyn ArmKinematics) -> Self {
        let torque_n_m = arm.max_torque_n_m();
        let levers_m = longest_levers_m(arm);
        let pressed_n_m = |lever_m: f64| PRESSED_HAND_N * (lever_m + BESIDE_TOOL_M);
        // An impact may press twice as hard (ISO/TS 15066). No joint needs more, whatever its description states; short levers are not known so well.
        let longest_m = levers_m.into_iter().fold(0.0, f64::max);
        let most_n_m = |lever_m| (2.0 * pressed_n_m(longest_m)).min(4.0 * pressed_n_m(lever_m));
        Self {
            position: *arm.limits(),
            velocity_rad_per_s: *arm.max_velocity_rad_per_s(),
            acceleration_rad_per_s2: arm
                .accelerations_or(hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2),
            torque_n_m: std::array::from_fn(|i| {
                torque_n_m[i].map_or_else(
                    || pressed_n_m(levers_m[i]),
                    |n_m| n_m.min(most_n_m(levers_m[i])),
                )
            }),
            torque_rate_n_m_per_s: 1000.0,
            position_slack_rad: 0.01,
            velocity_slack: 0.2,
            leap_rad: 0.5,
            workspace: None,
        }
    }

    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        for limit in &self.position {
            let ordered = limit.min_rad <= limit.max_rad;
            that(
                ordered,
                "position",
                limit.max_rad,
                "at least the lower limit",
            )?;
        }
        for velocity in self.velocity_rad_per_s {
            positive("velocity_rad_per_s", velocity)?;
        }
        for acceleration in self.acceleration_rad_per_s2 {
            positive("acceleration_rad_per_s2", acceleration)?;
        }
        for torque in self.torque_n_m {
            positive("torque_n_m", torque)?;
        }
        positive("torque_rate_n_m_per_s", self.torque_rate_n_m_per_s)?;
        non_negative("position_slack_rad", self.position_slack_rad)?;
        non_negative("velocity_slack", self.velocity_slack)?;
        positive("leap_rad", self.leap_rad)?;
        self.workspace.map_or(Ok(()), |inside| inside.validate())
    }

    /// Is a measured state within the limits?
    pub(in crate::safety) fn check_state(
        &self,
        joints: usize,
        state: &ArmState,
    ) -> Result<(), SafeReason> {
        self.check_motion(joints, state)?;
        self.check_torque(joints, state)
    }

    /// Are measured angles and velocities within the limits?
    pub(in crate::safety) fn check_motion(
        &self,
        joints: usize,
        state: &ArmState,
    ) -> Result<(), SafeReason> {
        for joint in 0..joints.min(MOST_JOINTS) {
            let q = state.q[joint];
            let wide = self.position[joint].shrunk(-self.position_slack_rad);
            if !wide.contains(q) {
                return beyond(Channel::Position, joint, q);
            }
            let qd = state.qd[joint];
            if qd.abs() > self.velocity_rad_per_s[joint] * (1.0 + self.velocity_slack) {
                return beyond(Channel::Velocity, joint, qd);
            }
        }
        Ok(())
    }

    /// Are the external torques within the limits?
    pub(in crate::safety) fn check_torque(
        &self,
        joints: usize,
        state: &ArmState,
    ) -> Result<(), SafeReason> {
        let torque = state.external_torque.unwrap_or_default();
        let is_beyond = |joint: &usize| torque[*joint].abs() > self.torque_n_m[*joint];
        match (0..joints.min(MOST_JOINTS)).find(is_beyond) {
            Some(joint) => beyond(Channel::Torque, joint, torque[joint]),
            None => Ok(()),
        }
    }

    /// A commanded position clamped to the angle limits, and what was cut.
    pub(in crate::safety) fn within(
        &self,
        wanted: &JointPositions,
    ) -> (JointPositions, Option<SafeReason>) {
        let (mut out, mut cut) = (*wanted, None);
        for joint in 0..MOST_JOINTS {
            let limit = self.position[joint];
            if !limit.contains(wanted[joint]) {
                out[joint] = wanted[joint].clamp(limit.min_rad, limit.max_rad);
                cut = Some(SafeReason::CommandLimit {
                    channel: Channel::Position,
                    joint,
                });
            }
        }
        (out, cut)
    }

    /// Share of the joint velocities that keeps all of them within their limits, and the joint that meets a limit first.
    pub(in crate::safety) fn share_of_rates(
        &self,
        rates_rad_per_s: &[f64; MOST_JOINTS],
    ) -> (f64, Option<SafeReason>) {
        // Rounding of a motion planned at the limit is not a violation.
        const ROUNDING: f64 = 1.0 + 1e-6;
        let (mut share, mut cut) = (1.0, None);
        for (joint, rate) in rates_rad_per_s.iter().enumerate() {
            let most = self.velocity_rad_per_s[joint];
            if rate.abs() * share > most * ROUNDING {
                share = most / rate.abs();
                cut = Some(SafeReason::CommandLimit {
                    channel: Channel::Velocity,
                    joint,
                });
            }
        }
        (share, cut)
    }

    /// A torque within its limits of size and rate, and what was cut.
    pub(in crate::safety) fn limited_torque(
        &self,
        last: &JointTorques,
        wanted: &JointTorques,
        dt_s: f64,
    ) -> (JointTorques, Option<SafeReason>) {
        let (mut out, mut cut) = (*wanted, None);
        let most_change = self.torque_rate_n_m_per_s * dt_s;
        for joint in 0..MOST_JOINTS {
            let most = self.torque_n_m[joint];
            let sized = wanted[joint].clamp(-most, most);
            out[joint] = last[joint] + (sized - last[joint]).clamp(-most_change, most_change);
            if (out[joint] - wanted[joint]).abs() > 1e-9 {
                cut = Some(SafeReason::CommandLimit {
                    channel: Channel::Torque,
                    joint,
                });
            }
        }
        (out, cut)
    }
}
