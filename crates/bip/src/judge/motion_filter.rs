//! Common interface of all filters of this crate, for comparisons.

use crate::bank::Bank;
use crate::ensemble::EnsembleFilter;
use crate::error::BipError;
use crate::filter::{Filter, Observation, TimeToEnd};

/// An estimate of one motion in progress that takes evidence and predicts.
pub trait MotionFilter {
    /// Lets `dt` pass.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    fn predict(&mut self, dt: f64) -> Result<(), BipError>;

    /// Takes an observation of the present.
    ///
    /// # Errors
    /// Invalid evidence; the filter is then unchanged.
    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), BipError>;

    /// Mean and variance of some degrees of freedom at a phase.
    ///
    /// # Errors
    /// A phase that is not finite, an unknown degree of freedom, wrong lengths.
    fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError>;

    /// Mean and variance of a measurement at a phase.
    ///
    /// # Errors
    /// As [`moments_at`](Self::moments_at).
    fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError>;

    /// Time left until the end; `None` if it cannot be predicted, or the filter does not support it.
    fn time_to_end(&mut self) -> Option<TimeToEnd> {
        None
    }

    /// Mean of the phase.
    fn phase(&self) -> f64;

    /// Mean of the phase velocity, 1/time.
    fn phase_velocity(&self) -> f64;

    /// Covariance of phase and phase velocity.
    fn phase_covariance(&mut self) -> [[f64; 2]; 2];
}

/// Forwards to the methods of the same names of each filter.
macro_rules! motion_filter {
    ($filter:ty $(, $time_to_end:ident)?) => {
        impl MotionFilter for $filter {
            fn predict(&mut self, dt: f64) -> Result<(), BipError> {
                <$filter>::predict(self, dt)
            }

            fn observe(&mut self, observation: &Observation<'_>) -> Result<(), BipError> {
                <$filter>::observe(self, observation).map(|_| ())
            }

            fn moments_at(
                &mut self,
                phase: f64,
                dofs: &[usize],
                mean: &mut [f64],
                variance: &mut [f64],
            ) -> Result<(), BipError> {
                <$filter>::moments_at(self, phase, dofs, mean, variance)
            }

            fn predict_at(
                &mut self,
                phase: f64,
                dofs: &[usize],
                mean: &mut [f64],
                variance: &mut [f64],
            ) -> Result<(), BipError> {
                <$filter>::predict_at(self, phase, dofs, mean, variance)
            }

            $(fn time_to_end(&mut self) -> Option<TimeToEnd> {
                <$filter>::$time_to_end(self)
            })?

            fn phase(&self) -> f64 {
                <$filter>::phase(self)
            }

            fn phase_velocity(&self) -> f64 {
                <$filter>::phase_velocity(self)
            }

            fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
                <$filter>::phase_covariance(self)
            }
        }
    };
}

motion_filter!(Filter, time_to_end);
motion_filter!(Bank, time_to_end);
motion_filter!(EnsembleFilter);
