//! Roughness of a rendered texture for a simulated participant.

use crate::error::StudyError;
use crate::present::{Patch, Rendered, Stimulus};
use hwall::numeric::check::{finite, that};
use hwall::texton::{RoughnessModel, ScanAngle, Texture, Vibration};

/// The natural logarithm of the felt roughness: a curve over the rendered angle, a line over the rendered speed, a
/// power of the force.
///
/// A model for planting effects, not a model of perception.
#[derive(Debug, Clone, PartialEq)]
pub struct Roughness {
    /// Increasing angles, degrees, and their logarithms; linear between, constant beyond.
    pub over_angle: Vec<[f64; 2]>,
    /// Change of the logarithm per 100 mm/s of board speed.
    pub per_100_mm_per_s: f64,
    /// Exponent of the force, relative to 7.5 N.
    pub force_exponent: f64,
    /// On a printed patch the logarithm is instead this exponent times that of the prediction of [`Vibration`] for the patch, relative to
    /// that for the released texture across its bumps at 60 mm/s.
    pub patch_exponent: f64,
}

/// Nominal force of a touch, N.
const NOMINAL_N: f64 = 7.5;
/// Nominal speed of the scanning finger, mm/s.
const NOMINAL_MM_PER_S: f64 = 60.0;

impl Default for Roughness {
    /// The dissertation's order: 0 < 45 < 63.43 ~ 71.57 ~ 90 degrees, rising with speed. Effect sizes give, with
    /// [`ParticipantConfig::default`](super::ParticipantConfig), F values like the dissertation's: 71.7, 15.9 and 0.44.
    fn default() -> Self {
        Self {
            over_angle: vec![
                [0.0, 0.0],
                [45.0, 0.35],
                [63.43, 0.5],
                [71.57, 0.5],
                [90.0, 0.5],
            ],
            per_100_mm_per_s: 0.28,
            force_exponent: 0.1,
            patch_exponent: 0.4,
        }
    }
}

impl Roughness {
    /// Rejects curves that do not rise in angle, and numbers that are not finite.
    ///
    /// # Errors
    /// The first such number.
    pub fn validate(&self) -> Result<(), StudyError> {
        let small = |what: &'static str, value: f64| {
            finite(what, value)?;
            that(value.abs() <= 1e3, what, value, "within 1e3 of zero")
        };
        small("per_100_mm_per_s", self.per_100_mm_per_s)?;
        small("force_exponent", self.force_exponent)?;
        small("patch_exponent", self.patch_exponent)?;
        let count = self.over_angle.len() as f64;
        that(count > 0.0, "points over the angle", count, "at least 1")?;
        for [deg, ln] in &self.over_angle {
            finite("angle", *deg)?;
            small("logarithm of roughness", *ln)?;
        }
        for pair in self.over_angle.windows(2) {
            let rises = pair[0][0] < pair[1][0];
            that(rises, "angle", pair[1][0], "above the one before")?;
        }
        Ok(())
    }

    /// The logarithm at an angle and a speed, at the nominal force.
    #[must_use]
    pub fn ln(&self, angle_deg: f64, speed_mm_per_s: f64) -> f64 {
        let points = &self.over_angle;
        let above = points.partition_point(|[deg, _]| *deg <= angle_deg);
        let by_angle = match (
            above.checked_sub(1).and_then(|i| points.get(i)),
            points.get(above),
        ) {
            (Some([a, x]), Some([b, y])) => x + (y - x) * (angle_deg - a) / (b - a),
            (Some([_, x]), None) | (None, Some([_, x])) => *x,
            (None, None) => 0.0,
        };
        by_angle + 0.01 * self.per_100_mm_per_s * speed_mm_per_s
    }

    /// The logarithm for a wanted stimulus, at the nominal force and scan.
    #[must_use]
    pub fn wanted(&self, stimulus: &Stimulus) -> Option<f64> {
        let (angle_deg, speed) = (stimulus.angle_deg, stimulus.speed_mm_per_s);
        match stimulus.patch {
            None => Some(self.ln(angle_deg, speed)),
            Some(patch) => self.ln_of_patch(patch, angle_deg, NOMINAL_MM_PER_S + speed),
        }
    }

    /// The logarithm on a printed patch at a speed over it; `None` if the model has no prediction above zero.
    fn ln_of_patch(&self, patch: Patch, angle_deg: f64, over_mm_per_s: f64) -> Option<f64> {
        let of = |texture: &Texture, deg: f64, speed: f64| {
            let scan = ScanAngle::from_deg(deg).ok()?;
            let predicted = Vibration::default().predict(texture, scan, speed).ok()?;
            predicted.value().filter(|v| *v > 0.0)
        };
        let nominal = of(&Texture::released(), 90.0, NOMINAL_MM_PER_S)?;
        let here = of(&patch.texture(), angle_deg, over_mm_per_s)?;
        Some(self.patch_exponent * (here / nominal).ln())
    }

    /// The logarithm for a rendered stimulus; `None` if it was not felt.
    #[must_use]
    pub fn felt(&self, rendered: &Rendered) -> Option<f64> {
        let force = rendered.force_n.filter(|f| *f > 0.0)?;
        let (angle_deg, speed) = (rendered.angle_deg?, rendered.speed_mm_per_s?);
        let at = match rendered.patch {
            None => self.ln(angle_deg, speed),
            Some(patch) => self.ln_of_patch(patch, angle_deg, rendered.felt_mm_per_s?)?,
        };
        Some(at + self.force_exponent * (force / NOMINAL_N).ln())
    }
}
