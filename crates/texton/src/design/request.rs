//! A request for a design: wanted roughness levels, prediction model and limits.

use super::limits::{DeviceLimits, PrintProcess, ProcessLimits};
use crate::error::{Result, TextonError};
use crate::geometry::Texture;
use crate::levels::Calibration;
use crate::roughness::RoughnessModel;
use hwall_numeric::check::{finite, positive, that};

/// Most levels of a design.
const MOST_LEVELS: usize = 64;
/// Bounds of magnitudes, so that products stay finite.
const SIZES: [f64; 2] = [1e-9, 1e9];

/// The roughness levels that are wanted, in any order.
#[derive(Debug, Clone, PartialEq)]
pub enum Wanted {
    /// Only the ratios count, as in magnitude estimation: 1, 2, 4 is the same as 3, 6, 12.
    Ratios(Vec<f64>),
    /// Magnitudes in the scale of a study.
    Magnitudes(Vec<f64>),
}

impl Wanted {
    pub(super) fn levels(&self) -> &[f64] {
        match self {
            Self::Ratios(levels) | Self::Magnitudes(levels) => levels,
        }
    }
}

/// Maps a model's prediction to the magnitude that people report: `gain · prediction ^ exponent`.
///
/// A model's source supports only the order of its predictions; ratios also need this assumption.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnitudeScale {
    /// Magnitude of a prediction of 1.
    pub gain: f64,
    /// Stevens' exponent.
    pub exponent: f64,
    /// Standard deviation of the natural logarithms about the law; `None` if the law is assumed.
    pub ln_sd: Option<f64>,
}

impl Default for MagnitudeScale {
    /// Magnitudes proportional to the prediction: an assumption.
    fn default() -> Self {
        Self {
            gain: 1.0,
            exponent: 1.0,
            ln_sd: None,
        }
    }
}

impl MagnitudeScale {
    /// Fits the law to a study's conditions, by least squares of logarithms. `texture`: the study's patch;
    /// `finger_mm_per_s`: speed of the participants' fingers.
    ///
    /// Ignores conditions without a positive prediction and magnitude.
    ///
    /// # Errors
    /// Fewer than three such conditions, or a magnitude that does not rise with the prediction.
    pub fn from_calibration(
        model: &dyn RoughnessModel,
        texture: &Texture,
        calibration: &Calibration,
        finger_mm_per_s: f64,
    ) -> Result<Self> {
        let mut points = Vec::new();
        for node in calibration.nodes() {
            let speed = node.speed_mm_per_s + finger_mm_per_s;
            let predicted = model.predict(texture, node.scan, speed)?.value();
            if let Some(x) = predicted.filter(|x| *x > 0.0)
                && node.magnitude > 0.0
            {
                points.push((x.ln(), node.magnitude.ln()));
            }
        }
        let n = points.len() as f64;
        let few = TextonError::TooFewLevels {
            wanted: 3,
            levels: points.len(),
        };
        if points.len() < 3 {
            return Err(few);
        }
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
        let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
        let xx: f64 = points.iter().map(|p| (p.0 - x0).powi(2)).sum();
        let xy: f64 = points.iter().map(|p| (p.0 - x0) * (p.1 - y0)).sum();
        let exponent = xy / xx;
        that(
            exponent > 0.0 && exponent.is_finite(),
            "exponent",
            exponent,
            "above zero: magnitudes that rise with the prediction",
        )?;
        let off = |p: &(f64, f64)| (p.1 - y0 - exponent * (p.0 - x0)).powi(2);
        let left: f64 = points.iter().map(off).sum();
        Ok(Self {
            gain: (y0 - exponent * x0).exp(),
            exponent,
            ln_sd: Some((left / (n - 2.0)).sqrt()),
        })
    }

    fn validate(&self) -> Result<()> {
        for (what, value) in [("gain", self.gain), ("exponent", self.exponent)] {
            let holds = (1e-6..=1e6).contains(&value);
            that(holds, what, value, "1e-6 to 1e6")?;
        }
        Ok(())
    }
}

/// Source of the roughness.
#[derive(Clone, Copy)]
pub enum RoughnessSource<'a> {
    /// A model, for any texture.
    Model {
        /// The model.
        model: &'a dyn RoughnessModel,
        /// Maps its predictions to magnitudes.
        scale: MagnitudeScale,
    },
    /// The table of a study, valid for its patch and its participants' finger speed.
    Table {
        /// The table.
        calibration: &'a Calibration,
        /// The patch that the study used.
        texture: Texture,
    },
}

/// What happens if the wanted ratios are wider than any texture allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// Refuse the design; the error states the possible ratio.
    #[default]
    Refuse,
    /// Narrow all ratios by one power; the design reports it.
    Allow,
}

/// Input of a design.
#[derive(Clone)]
pub struct DesignRequest<'a> {
    /// Roughness levels.
    pub wanted: Wanted,
    /// How roughness is predicted.
    pub source: RoughnessSource<'a>,
    /// What the printer can make.
    pub printer: ProcessLimits,
    /// What the device can present.
    pub device: DeviceLimits,
    /// Just noticeable difference of magnitudes, relative. The default of 0.1 is an assumption: published fractions for the
    /// spatial period of gratings are about half of that (Morley, Goodwin, Darian-Smith 1983), and estimates for whole
    /// textures scatter more.
    pub weber_fraction: f64,
    /// What happens to ratios that are too wide.
    pub compression: Compression,
    /// Candidates returned, at most; 5 by default.
    pub most_candidates: usize,
}

impl<'a> DesignRequest<'a> {
    /// These ratios, with the model's predictions as magnitudes and the typical limits of printer and device.
    #[must_use]
    pub fn of_ratios(
        ratios: Vec<f64>,
        model: &'a dyn RoughnessModel,
        process: PrintProcess,
    ) -> Self {
        Self {
            wanted: Wanted::Ratios(ratios),
            source: RoughnessSource::Model {
                model,
                scale: MagnitudeScale::default(),
            },
            printer: process.limits(),
            device: DeviceLimits::default(),
            weber_fraction: 0.1,
            compression: Compression::default(),
            most_candidates: 5,
        }
    }

    pub(super) fn validate(&self) -> Result<()> {
        let levels = self.wanted.levels();
        let count = levels.len() as f64;
        let holds = (1..=MOST_LEVELS).contains(&levels.len());
        that(holds, "number of wanted levels", count, "1 to 64")?;
        for level in levels {
            finite("wanted roughness", *level)?;
            positive("wanted roughness", *level)?;
            let holds = (SIZES[0]..=SIZES[1]).contains(level);
            that(holds, "wanted roughness", *level, "1e-9 to 1e9")?;
        }
        let weber = self.weber_fraction;
        let holds = (1e-3..=10.0).contains(&weber);
        that(holds, "weber_fraction", weber, "0.001 to 10")?;
        let most = self.most_candidates as f64;
        that(
            self.most_candidates > 0,
            "most_candidates",
            most,
            "at least 1",
        )?;
        if let RoughnessSource::Model { scale, .. } = &self.source {
            scale.validate()?;
        }
        self.printer.validate()?;
        self.device.validate()
    }

    /// Distance of two magnitudes, in just noticeable differences.
    pub(super) fn steps_between(&self, less: f64, more: f64) -> f64 {
        (more / less).ln().abs() / self.weber_fraction.ln_1p()
    }
}
