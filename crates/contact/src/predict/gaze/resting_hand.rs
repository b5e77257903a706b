//! Where a person touches whose hand rests.

use super::super::gaussian::Gaussian;
use crate::error::ContactError;
use crate::matrices::isotropic;
use glam::{DMat3, DVec3};
use hwall_numeric::check::{all_finite, that};

/// The next contact, seen from the place where the hand rests: a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestingHand {
    /// Mean, m, in the axes of the frame it was learnt in. Default zero.
    pub mean_m: DVec3,
    /// Covariance, m², symmetric and positive definite. Default 0.4 m in each axis.
    pub covariance_m2: DMat3,
}

/// Spread where nothing was learnt, m.
const SD_M: f64 = 0.4;

impl Default for RestingHand {
    fn default() -> Self {
        Self {
            mean_m: DVec3::ZERO,
            covariance_m2: isotropic(SD_M),
        }
    }
}

impl RestingHand {
    /// About a hand that rests at a place.
    pub(in crate::predict) fn about(&self, hand_m: DVec3) -> Option<Gaussian> {
        Gaussian::new(hand_m + self.mean_m, self.covariance_m2)
    }

    pub(in crate::predict) fn validate(&self) -> Result<(), ContactError> {
        all_finite("mean_m", &self.mean_m.to_array())?;
        all_finite("covariance_m2", &self.covariance_m2.to_cols_array())?;
        let determinant = self.covariance_m2.determinant();
        let usable = determinant > 0.0 && self.about(DVec3::ZERO).is_some();
        that(
            usable,
            "covariance_m2 (determinant)",
            determinant,
            "that of a covariance",
        )?;
        Ok(())
    }
}
