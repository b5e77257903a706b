//! The joint servo: a reference motion, and the accelerations towards it.

use super::config::TorqueConfig;
use crate::arm::config::ServoConfig;
use crate::arm::servo::ServoArm;
use crate::error::SimError;
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Follows position commands with a limited reference motion, that of a [`ServoArm`], and computes the accelerations towards it.
#[derive(Debug)]
pub(super) struct ReferenceServo {
    reference: ServoArm,
    stiffness_per_s2: f64,
    damping_per_s: f64,
    period_s: f64,
}

impl ReferenceServo {
    /// At rest at `start`, holding.
    pub(super) fn new(
        arm: Arc<dyn ArmKinematics>,
        start: JointPositions,
        config: &TorqueConfig,
    ) -> Result<Self, SimError> {
        let servo = &config.servo;
        let omega = TAU * servo.frequency_hz;
        let reference = ServoArm::new(
            arm,
            start,
            ServoConfig {
                reaction_delay_s: config.command_delay_s,
                max_velocity_rad_per_s: servo.max_velocity_rad_per_s,
                max_acceleration_rad_per_s2: servo.max_acceleration_rad_per_s2,
                jerk_time_s: servo.jerk_time_s,
                torque_noise_n_m: 0.0,
                ..ServoConfig::default()
            },
        )?;
        Ok(Self {
            reference,
            stiffness_per_s2: omega * omega,
            damping_per_s: 2.0 * servo.damping_ratio * omega,
            period_s: config.control_period_s,
        })
    }

    /// Position of the reference.
    pub(super) fn position(&self) -> JointPositions {
        self.reference.q()
    }

    /// Commands a position, or braking and holding, with the delay.
    pub(super) fn command(&mut self, command: ArmCommand) -> Result<(), SimError> {
        self.reference.command(command)
    }

    /// Sets the reference to the state of the arm, so that the servo takes over smoothly.
    pub(super) fn follow(&mut self, q: &JointPositions, qd: &JointVelocities) {
        self.reference.place(q, qd);
    }

    /// Advances the reference by a control period; returns the accelerations for that period, rad/s².
    pub(super) fn accelerations(
        &mut self,
        q: &JointPositions,
        qd: &JointVelocities,
    ) -> Result<[f64; 7], SimError> {
        let (q_now, qd_now) = (self.reference.q(), self.reference.qd());
        self.reference.advance(self.period_s)?;
        let qd_next = self.reference.qd();
        Ok(std::array::from_fn(|i| {
            (qd_next[i] - qd_now[i]) / self.period_s
                + self.damping_per_s * (qd_now[i] - qd[i])
                + self.stiffness_per_s2 * (q_now[i] - q[i])
        }))
    }
}
