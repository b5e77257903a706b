//! Estimation of external torques from torque sensors and a model.

use hwall_kinematics::{ChainDynamics, DynamicsScratch, KinematicsError};
use hwall_numeric::check::all_finite;
use std::f64::consts::TAU;

/// A momentum observer ([De Luca 2006]), with torque sensors behind the gears.
///
/// `ṗ = τ_sensor + τ_ext + ∂T/∂q − g`: a change of momentum that sensors and model do not explain is external. The
/// estimate is low-pass filtered (first order). Friction and rotors are on the motor side of the sensors and do not enter
/// the estimate.
#[derive(Debug, Clone)]
pub(super) struct MomentumObserver {
    model: ChainDynamics,
    scratch: DynamicsScratch,
    /// Filter gain per period.
    share: f64,
    period_s: f64,
    momentum: [f64; 7],
    /// `∂T/∂q − g` at the last update.
    drift: [f64; 7],
    external: [f64; 7],
}

impl MomentumObserver {
    pub(super) fn new(model: ChainDynamics, bandwidth_hz: f64, period_s: f64) -> Self {
        let scratch = model.scratch();
        Self {
            model,
            scratch,
            share: -(-TAU * bandwidth_hz * period_s).exp_m1(),
            period_s,
            momentum: [0.0; 7],
            drift: [0.0; 7],
            external: [0.0; 7],
        }
    }

    /// Initializes at a state without external torque.
    pub(super) fn begin(&mut self, q: &[f64], qd: &[f64]) -> Result<(), KinematicsError> {
        (self.momentum, self.drift) = self.evaluate(q, qd)?;
        self.external = [0.0; 7];
        Ok(())
    }

    fn evaluate(&mut self, q: &[f64], qd: &[f64]) -> Result<([f64; 7], [f64; 7]), KinematicsError> {
        let n = q.len();
        let (mut momentum, mut drift, mut gravity) = ([0.0; 7], [0.0; 7], [0.0; 7]);
        let scratch = &mut self.scratch;
        self.model
            .momentum_into(q, qd, scratch, &mut momentum[..n], &mut drift[..n])?;
        self.model
            .gravity_torque_into(q, scratch, &mut gravity[..n])?;
        for (drift, gravity) in drift.iter_mut().zip(gravity) {
            *drift -= gravity;
        }
        Ok((momentum, drift))
    }

    /// Updates after one period: state, and mean sensor readings since the last call.
    pub(super) fn update(
        &mut self,
        q: &[f64],
        qd: &[f64],
        readings: &[f64; 7],
    ) -> Result<(), KinematicsError> {
        let (momentum, drift) = self.evaluate(q, qd)?;
        let mut external = self.external;
        for i in 0..q.len() {
            let unexplained = (momentum[i] - self.momentum[i]) / self.period_s
                - readings[i]
                - 0.5 * (drift[i] + self.drift[i]);
            external[i] += self.share * (unexplained - external[i]);
        }
        all_finite("external torques", &external)?;
        (self.momentum, self.drift, self.external) = (momentum, drift, external);
        Ok(())
    }

    /// The latest estimate, N m.
    pub(super) const fn external(&self) -> &[f64; 7] {
        &self.external
    }
}
