//! The interface of roughness models: predictions and information about the model.

use crate::error::Result;
use crate::geometry::{ScanAngle, Texture};

/// Predicts how rough a texture feels under a moving finger.
///
/// Models are compared and chosen, never blended: each predicts in its own unit, and only the order
/// of its predictions is meaningful.
pub trait RoughnessModel: Send + Sync {
    /// Source, range of validity and known failures of the model.
    fn info(&self) -> &'static ModelInfo;

    /// The prediction for a scan at this speed of the finger relative to the texture, mm/s.
    ///
    /// # Errors
    /// A speed that is negative, NaN or infinite.
    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction>;
}

/// Information about a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelInfo {
    /// A short name for tables.
    pub name: &'static str,
    /// The predicted quantity, with its unit.
    pub quantity: &'static str,
    /// The publication, or this crate.
    pub source: &'static str,
    /// Range of the measurements.
    pub range: &'static str,
    /// Known failures.
    pub misfit: &'static str,
    /// Does the prediction depend on speed?
    pub depends_on_speed: bool,
}

/// A model's prediction of roughness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prediction {
    /// Within the range in which the model was measured.
    Within(f64),
    /// The value of the formula outside that range.
    Beyond {
        /// The prediction.
        value: f64,
        /// The quantity that leaves the range.
        what: Quantity,
        /// Value of that quantity.
        at: f64,
        /// The range, from least to greatest.
        range: [f64; 2],
    },
    /// The model says nothing about this scan.
    Undefined(Quantity),
}

impl Prediction {
    /// The number, within the range or not.
    #[must_use]
    pub const fn value(&self) -> Option<f64> {
        match *self {
            Self::Within(value) | Self::Beyond { value, .. } => Some(value),
            Self::Undefined(_) => None,
        }
    }

    /// Is it within the model's range?
    #[must_use]
    pub const fn is_within(&self) -> bool {
        matches!(self, Self::Within(_))
    }

    /// `value`, marked as within the model's range if all inputs are.
    pub(super) fn checked(value: f64, inputs: &[RangedInput]) -> Self {
        let outside = |input: &&RangedInput| {
            let [least, most] = input.range;
            !(least..=most).contains(&input.value)
        };
        match inputs.iter().find(outside) {
            None => Self::Within(value),
            Some(input) => Self::Beyond {
                value,
                what: input.quantity,
                at: input.value,
                range: input.range,
            },
        }
    }
}

/// An input of a prediction, and the model's measured range.
pub(super) struct RangedInput {
    pub(super) quantity: Quantity,
    pub(super) value: f64,
    pub(super) range: [f64; 2],
}

/// Quantity that the range of a model refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Bare plate between two bumps along the scan, mm.
    GrooveMm,
    /// Length of a bump along the scan, mm.
    RidgeMm,
    /// Distance from bump to bump along the scan, mm; undefined if the scan passes the ends of the bumps.
    SpacingMm,
    /// Bumps per second, Hz; undefined without motion.
    FrequencyHz,
}
