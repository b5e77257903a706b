//! Torque sensors behind the gears.

use hwall_numeric::ArgumentError;
use hwall_numeric::check::{all_finite, non_negative};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Errors of the torque sensors of all joints.
///
/// A sensor reports the mean torque through it over a control period, plus `bias + ripple
/// sin(ripples_per_turn q + phase) + noise`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueSensor {
    /// Standard deviation of the noise of each reading, N m. Default 0.05, an assumption.
    pub noise_n_m: f64,
    /// Constant error of each joint, N m. Default 0.
    pub bias_n_m: [f64; 7],
    /// Amplitude of an error periodic in the joint angle, N m. Default 0.1, an assumption: iiwa users report that such a
    /// ripple limits the built-in torque loop.
    pub ripple_n_m: [f64; 7],
    /// Periods per turn of the joint. Default 320: two per turn of the wave generator of a 160:1 gear.
    pub ripples_per_turn: f64,
    /// Phase at joint angle 0, rad. Default 0 to 6 in steps of 1.
    pub ripple_phase_rad: [f64; 7],
}

impl Default for TorqueSensor {
    fn default() -> Self {
        Self {
            noise_n_m: 0.05,
            bias_n_m: [0.0; 7],
            ripple_n_m: [0.1; 7],
            ripples_per_turn: 320.0,
            ripple_phase_rad: [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        }
    }
}

impl TorqueSensor {
    /// Without errors.
    #[must_use]
    pub fn perfect() -> Self {
        Self {
            noise_n_m: 0.0,
            ripple_n_m: [0.0; 7],
            ..Self::default()
        }
    }

    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        non_negative("noise_n_m", self.noise_n_m)?;
        all_finite("bias_n_m", &self.bias_n_m)?;
        all_finite("ripple_n_m", &self.ripple_n_m)?;
        non_negative("ripples_per_turn", self.ripples_per_turn)?;
        all_finite("ripple_phase_rad", &self.ripple_phase_rad)
    }
}

/// The sensors with their noise generator.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    errors: TorqueSensor,
    generator: Pcg64,
}

impl Sensors {
    pub(super) fn new(errors: TorqueSensor, seed: u64) -> Self {
        Self {
            errors,
            generator: Pcg64::seed_from_u64(seed),
        }
    }

    /// Readings for true torques, N m, at joint angles, rad.
    pub(super) fn read(&mut self, torques: &[f64; 7], q: &[f64; 7]) -> [f64; 7] {
        let errors = &self.errors;
        // Draw seven numbers for any arm, so that a seed gives the same noise on the same joint.
        std::array::from_fn(|i| {
            let noise = self.generator.sample::<f64, _>(StandardNormal);
            let angle = (errors.ripples_per_turn * q[i]) % TAU + errors.ripple_phase_rad[i];
            torques[i]
                + errors.bias_n_m[i]
                + errors.ripple_n_m[i] * angle.sin()
                + errors.noise_n_m * noise
        })
    }
}
