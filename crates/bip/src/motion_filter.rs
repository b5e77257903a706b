//! What all filters of this crate have in common, so that they can be compared.

use crate::{Bank, BipError, EnsembleFilter, Filter, Observation};

/// A belief about one motion in progress that takes evidence and predicts.
pub trait MotionFilter {
    /// Lets `dt` pass.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    fn predict(&mut self, dt: f64) -> Result<(), BipError>;

    /// Takes an observation of the present.
    ///
    /// # Errors
    /// Bad evidence; the belief stays as it was.
    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), BipError>;

    /// Mean and variance of some degrees of freedom at a phase.
    ///
    /// # Errors
    /// A phase that is not finite, an unknown degree of freedom, other lengths.
    fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError>;

    /// Mean and variance of what will be measured at a phase.
    ///
    /// # Errors
    /// As [`moments_at`](Self::moments_at).
    fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.moments_at(phase, dofs, mean, variance)?;
        for (v, &d) in variance.iter_mut().zip(dofs) {
            *v = self.spread().powi(2) * (*v + self.residual_variance(d).unwrap_or(0.0));
        }
        Ok(())
    }

    /// Variance of a new motion around what the model can express of it, which is not part of
    /// [`moments_at`](Self::moments_at).
    fn residual_variance(&self, dof: usize) -> Option<f64>;

    /// Factor on standard deviations, of shape and residual together, that makes intervals hold
    /// what they promise; 1 where nothing is known.
    fn spread(&self) -> f64 {
        1.0
    }

    /// Mean of the phase.
    fn phase(&self) -> f64;

    /// Mean of the phase velocity, 1/time.
    fn phase_velocity(&self) -> f64;

    /// Covariance of phase and phase velocity.
    fn phase_covariance(&mut self) -> [[f64; 2]; 2];
}

macro_rules! motion_filter {
    ($filter:ty, $($more:item)?) => {
        impl MotionFilter for $filter {
            $($more)?

            fn predict(&mut self, dt: f64) -> Result<(), BipError> {
                self.predict(dt)
            }

            fn observe(&mut self, observation: &Observation<'_>) -> Result<(), BipError> {
                self.observe(observation).map(|_| ())
            }

            fn moments_at(
                &mut self,
                phase: f64,
                dofs: &[usize],
                mean: &mut [f64],
                variance: &mut [f64],
            ) -> Result<(), BipError> {
                self.moments_at(phase, dofs, mean, variance)
            }

            fn residual_variance(&self, dof: usize) -> Option<f64> {
                self.residual_variance(dof)
            }

            fn spread(&self) -> f64 {
                self.spread()
            }

            fn phase(&self) -> f64 {
                self.phase()
            }

            fn phase_velocity(&self) -> f64 {
                self.phase_velocity()
            }

            fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
                <$filter>::phase_covariance(self)
            }
        }
    };
}

motion_filter!(
    Filter,
    fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.predict_at(phase, dofs, mean, variance)
    }
);
motion_filter!(
    Bank,
    fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.predict_at(phase, dofs, mean, variance)
    }
);
motion_filter!(EnsembleFilter,);
