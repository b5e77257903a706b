//! Models of the skin: simple estimates of the responses of its afferents.

use super::model::{ModelInfo, Prediction, RoughnessModel};
use super::skin::Skin;
use crate::error::Result;
use crate::geometry::{ScanAngle, Texture};
use glam::{DVec2, dvec2};
use hwall_numeric::check::{non_negative, positive};
use std::f64::consts::TAU;

/// Which pairs of afferents [`SpatialVariation`] compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum AfferentPairs {
    /// In every direction: the same prediction for every scan of one texture.
    Around,
    /// One behind the other along the scan.
    Along,
    /// Side by side across the scan: varies with orientation like the responses of a simulated hand
    /// (TouchSim, Saal and others 2017).
    #[default]
    Across,
}

/// Difference between the responses of slowly adapting (SA1) afferents a fixed distance apart.
///
/// The height of the texture, blurred by the skin, represents firing rates; the prediction is the root mean
/// square difference between two points, mm. The published measure is the mean absolute difference of firing
/// rates in no particular direction. The direction is a setting, because it decides the model's dependence
/// on orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpatialVariation {
    /// Distance of the two afferents, mm; default 2.
    pub apart_mm: f64,
    /// Standard deviation of the skin's blur, mm, at least 0.05; default 0.5, an assumption.
    pub blur_mm: f64,
    /// Which pairs are compared; by default those across the scan.
    pub pairs: AfferentPairs,
}

impl Default for SpatialVariation {
    fn default() -> Self {
        Self {
            apart_mm: 2.0,
            blur_mm: 0.5,
            pairs: AfferentPairs::Across,
        }
    }
}

impl RoughnessModel for SpatialVariation {
    fn info(&self) -> &'static ModelInfo {
        const INFO: ModelInfo = ModelInfo {
            name: "SA1 spatial variation",
            quantity: "rms difference of the blurred height 2 mm apart, mm",
            source: "after Connor, Johnson 1992; Blake, Hsiao, Johnson 1997; own computation",
            range: "embossed dots and gratings, spacings of 1 mm and above",
            misfit: "ignores speed and the direction of the scan",
            depends_on_speed: false,
        };
        match self.pairs {
            AfferentPairs::Around => &INFO,
            AfferentPairs::Along => &ModelInfo {
                name: "SA1 variation along the scan",
                misfit: "ignores speed; falls with orientation on the released grid, whose short pitch is nearly the distance of the afferents",
                ..INFO
            },
            AfferentPairs::Across => &ModelInfo {
                name: "SA1 variation across the scan",
                misfit: "ignores speed; highest at 63 degrees on the released grid, and in another order on a grid with pitches of 7 and 3 mm",
                ..INFO
            },
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        non_negative("speed_mm_per_s", speed_mm_per_s)?;
        positive("apart_mm", self.apart_mm)?;
        let skin = Skin::new(self.blur_mm)?;
        let (cos, sin) = (scan.cos(), scan.sin());
        // Parseval's theorem: each of the waves ±k has power c², scaled by |1 - e^(i k d)|² for a shift by d.
        let difference = |k: DVec2| {
            let shift_rad = |direction| TAU * cycles_per_mm(k, direction) * self.apart_mm;
            match self.pairs {
                AfferentPairs::Around => 2.0 - 2.0 * libm::j0(k.x.hypot(k.y) * self.apart_mm),
                AfferentPairs::Along => 2.0 - 2.0 * shift_rad(dvec2(cos, sin)).cos(),
                AfferentPairs::Across => 2.0 - 2.0 * shift_rad(dvec2(-sin, cos)).cos(),
            }
        };
        let power: f64 = texture
            .harmonics(skin.limit_rad_per_mm())
            .map(|wave| {
                let k = wave.wave_rad_per_mm;
                (wave.amplitude_mm * skin.gain(k)).powi(2) * difference(k)
            })
            .sum();
        Ok(Prediction::Within(power.sqrt()))
    }
}

/// Vibration of the skin under a moving finger, weighted by the sensitivity of Pacinian (PC) afferents.
///
/// Every wave of the height passes the finger at `f = v (k · s) / 2π`. Its weight `2 x² / (1 + x⁴)`, `x = f / 250 Hz`,
/// rises with the square of the frequency up to the peak and falls as fast beyond; the prediction is the
/// root mean square of the weighted height, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vibration {
    /// Frequency of the greatest sensitivity, Hz; default 250.
    pub peak_hz: f64,
    /// Standard deviation of the skin's blur, mm, at least 0.05; default 0.5, an assumption.
    pub blur_mm: f64,
}

impl Default for Vibration {
    fn default() -> Self {
        Self {
            peak_hz: 250.0,
            blur_mm: 0.5,
        }
    }
}

impl RoughnessModel for Vibration {
    fn info(&self) -> &'static ModelInfo {
        &ModelInfo {
            name: "PC vibration",
            quantity: "rms height weighted by PC sensitivity, mm",
            source: "after Bensmaïa, Hollins 2003, 2005 (Pacinian-weighted power of the vibration); own computation",
            range: "published for periods below 0.2 mm; used here on bumps of millimetres at 20 to 200 mm/s",
            misfit: "grows with the square of the speed where firing rates and magnitude estimates grow less",
            depends_on_speed: true,
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        non_negative("speed_mm_per_s", speed_mm_per_s)?;
        positive("peak_hz", self.peak_hz)?;
        let skin = Skin::new(self.blur_mm)?;
        let direction = dvec2(scan.cos(), scan.sin());
        let power: f64 = texture
            .harmonics(skin.limit_rad_per_mm())
            .map(|wave| {
                let k = wave.wave_rad_per_mm;
                let x = speed_mm_per_s * cycles_per_mm(k, direction) / self.peak_hz;
                // The same as 2 x² / (1 + x⁴), which overflows at 1e77 Hz.
                let square = x * x;
                let weight = if square > 0.0 {
                    2.0 / (square + 1.0 / square)
                } else {
                    0.0
                };
                (wave.amplitude_mm * skin.gain(k) * weight).powi(2)
            })
            .sum();
        Ok(Prediction::Within(power.sqrt()))
    }
}

/// Cycles of a wave per mm along a direction.
fn cycles_per_mm(wave_rad_per_mm: DVec2, direction: DVec2) -> f64 {
    wave_rad_per_mm.dot(direction) / TAU
}
