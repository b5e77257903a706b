//! Checks a step's inputs and estimates the contact force.

use super::{AT_REST_S, Renderer};
use crate::arm::ArmState;
use crate::error::HapticsError;
use crate::low_pass;
use crate::render::config::ForceConfig;
use crate::render::hold::HoldReason;
use hwall_geometry::Wrench;
use hwall_kinematics::{JointVelocities, WrenchConfig, WrenchEstimate};

/// Larger forces are implausible, N: the torque sensors are broken, and the filter would take long to recover from such values.
const MAX_FORCE_N: f64 = 1e4;
/// Joints slower than this count as at rest even if they brake gently, rad/s: ten times the noise of velocities.
const NOISE_RAD_PER_S: f64 = 5e-3;
/// A motion that could stop within this time has stopped, s.
const ROUNDING_S: f64 = 1e-9;

impl Renderer {
    /// The time by which the command advances.
    pub(super) fn tick(&mut self, now_s: f64) -> Result<f64, HoldReason> {
        if !now_s.is_finite() {
            return Err(HoldReason::NonFiniteTime);
        }
        // After the clock was set back, time counts from its new value.
        let elapsed_s = now_s - self.last_s.replace(now_s).unwrap_or(now_s);
        if elapsed_s < 0.0 {
            return Err(HoldReason::TimeReversed { by_s: -elapsed_s });
        }
        Ok(self.steps.advance(elapsed_s, self.watchdog.max_step_s))
    }

    pub(super) fn check_state(&self, now_s: f64, state: &ArmState) -> Result<(), HoldReason> {
        state.validate().map_err(|error| match error {
            HapticsError::NonFiniteState { what, joint, .. } => {
                HoldReason::NonFiniteState { what, joint }
            }
            _ => HoldReason::NonFiniteState {
                what: "state",
                joint: 0,
            },
        })?;
        let age_s = now_s - state.t_s;
        if age_s.abs() > self.watchdog.max_state_age_s {
            return Err(HoldReason::StaleState { age_s });
        }
        Ok(())
    }

    /// Resumes commanding the arm from its current configuration once it is at rest; false until then.
    pub(super) fn attach(&mut self, state: &ArmState) -> Result<bool, HoldReason> {
        if !self.is_detached {
            return Ok(true);
        }
        let fastest = state
            .qd
            .0
            .iter()
            .fold(0.0, |most: f64, qd| most.max(qd.abs()));
        let stop_s = self.follower.limits().stop_s(&state.qd);
        let qd = if stop_s > AT_REST_S && fastest > NOISE_RAD_PER_S {
            state.qd
        } else if self.follower.stop_s() > ROUNDING_S {
            // The remaining measured speed may be noise, or the end of a motion.
            return Ok(false);
        } else {
            self.is_detached = false;
            JointVelocities::default()
        };
        let bad = |_| HoldReason::NonFiniteState {
            what: "q",
            joint: 0,
        };
        self.follower.restart(&state.q, &qd).map_err(bad)?;
        Ok(!self.is_detached)
    }

    /// External wrench on the face at its measured pose (base axes, about its centre), and the pressing force, N.
    pub(super) fn felt(&self, state: &ArmState) -> Result<Option<(Wrench, f64)>, HoldReason> {
        let Some(torque) = state.external_torque else {
            return Ok(None);
        };
        let ForceConfig {
            damping_m,
            moment_length_m,
            ..
        } = self.force;
        let (face, jacobian) = self.arm().forward_and_jacobian(&state.q);
        let outward = face.rotation().z_axis;
        let config = WrenchConfig {
            damping_m,
            moment_length_m,
        };
        let found = WrenchEstimate::from_torques(&jacobian, &torque, &config);
        let wrench = found.map(|estimate| estimate.wrench).ok();
        let force_n = wrench.map_or(f64::NAN, |wrench| -wrench.normal_force_n(outward));
        // NaN, from torques too large to square, fails the comparison.
        match wrench {
            Some(wrench) if force_n.abs() <= MAX_FORCE_N => Ok(Some((wrench, force_n))),
            _ => Err(HoldReason::ImplausibleForce { force_n }),
        }
    }

    /// First-order low pass.
    pub(super) fn filtered(&mut self, force_n: f64, dt_s: f64) -> f64 {
        self.felt_n += low_pass::share(dt_s, self.force.filter_s) * (force_n - self.felt_n);
        self.felt_n
    }
}
