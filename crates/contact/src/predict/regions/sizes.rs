//! The sizes of the regions of one prediction.

use crate::error::ContactError;
use hwall_numeric::check::{positive, that};

/// Probabilities of the reported regions.
pub const REGION_SHARES: [f64; 3] = [0.5, 0.7, 0.9];

/// Sizes of the regions of a prediction: squared distances in standard deviations, in the plane of the surface, that contain a contact with the
/// probabilities of [`REGION_SHARES`].
///
/// The errors of predictions have heavy tails: most are much smaller than the covariance states, and a few are larger. So no single normal
/// distribution has correct regions of 50, 70 and 90 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionSizes {
    squared: [f64; 3],
}

impl RegionSizes {
    /// Sizes of a normal distribution in two dimensions: `-2 ln(1 - p)`.
    pub const NORMAL: Self = Self {
        squared: [
            1.386_294_361_119_890_6,
            2.407_945_608_651_872,
            4.605_170_185_988_091,
        ],
    };

    /// Given sizes: squared distances in standard deviations, in the order of [`REGION_SHARES`].
    ///
    /// # Errors
    /// A number that is not finite and above zero, or smaller than the one before.
    pub fn from_squared(squared: [f64; 3]) -> Result<Self, ContactError> {
        let what = "squared distance of a region";
        let mut least = 0.0;
        for value in squared {
            positive(what, value)?;
            least = that(
                value >= least,
                what,
                value,
                "no smaller than the one before",
            )?;
        }
        Ok(Self { squared })
    }

    /// `None` for a number that is not finite and positive; enforces that a region is at least as large as those with lower probability.
    pub(super) fn rising(mut squared: [f64; 3]) -> Option<Self> {
        squared[1] = squared[1].max(squared[0]);
        squared[2] = squared[2].max(squared[1]);
        Self::from_squared(squared).ok()
    }

    /// From the logarithms; enforces that a region is at least as large as those with lower probability.
    pub(super) fn from_logarithms(logarithms: [f64; 3]) -> Self {
        let mut squared = logarithms.map(f64::exp);
        squared[1] = squared[1].max(squared[0]);
        squared[2] = squared[2].max(squared[1]);
        Self { squared }
    }

    /// Squared radius of each region, in the order of [`REGION_SHARES`].
    #[must_use]
    pub const fn squared(&self) -> [f64; 3] {
        self.squared
    }
}

impl Default for RegionSizes {
    fn default() -> Self {
        Self::NORMAL
    }
}
