//! What a model of roughness is: a prediction, and what is known about it.

use crate::error::finite;
use crate::{ScanAngle, TextonError, Texture};

/// Predicts how rough a texture feels under a moving finger.
///
/// Models are compared and chosen, never blended: each answers in its own unit, and only the order
/// of its answers means roughness.
pub trait RoughnessModel: Send + Sync {
    /// Where the model comes from, where it holds, and where it is known to fail.
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
    ) -> Result<Prediction, TextonError>;
}

/// What is known about a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelInfo {
    /// A short name for tables.
    pub name: &'static str,
    /// What the number is, with its unit.
    pub quantity: &'static str,
    /// Who published it, or that it is this crate's own.
    pub source: &'static str,
    /// Where it was measured.
    pub range: &'static str,
    /// Where it is known to fail.
    pub misfit: &'static str,
    /// Does the prediction depend on speed?
    pub depends_on_speed: bool,
}

/// An answer of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prediction {
    /// Within the range in which the model was measured.
    Within(f64),
    /// The formula beyond that range.
    Beyond {
        /// The prediction.
        value: f64,
        /// The quantity that leaves the range.
        what: Quantity,
        /// Its value.
        at: f64,
        /// The range.
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

    pub(crate) fn checked(value: f64, checks: &[(Quantity, f64, [f64; 2])]) -> Self {
        let outside = |at: f64, [lo, hi]: [f64; 2]| !(lo..=hi).contains(&at);
        match checks.iter().find(|(_, at, range)| outside(*at, *range)) {
            None => Self::Within(value),
            Some(&(what, at, range)) => Self::Beyond {
                value,
                what,
                at,
                range,
            },
        }
    }
}

/// What a model's range is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Bare plate between two bumps along the scan, mm.
    GrooveMm,
    /// Length of a bump along the scan, mm.
    RidgeMm,
    /// From bump to bump along the scan, mm; undefined where the scan passes their ends.
    SpacingMm,
    /// Bumps a second, Hz; undefined without motion.
    FrequencyHz,
}

pub(crate) fn speed(speed_mm_per_s: f64) -> Result<(), TextonError> {
    finite("speed_mm_per_s", speed_mm_per_s)?;
    if speed_mm_per_s < 0.0 {
        return Err(TextonError::Parameter {
            what: "speed_mm_per_s",
            value: speed_mm_per_s,
            wanted: "at least 0",
        });
    }
    Ok(())
}
