//! Relief and slope of a picture within the band that a finger feels as texture.

use super::picture::{MaterialPicture, PictureKind};
use crate::error::{Result, TextonError};
use std::f64::consts::{LN_2, TAU};

/// Periods beyond the width of a fingertip are shape, not texture, mm.
const MOST_MM: f64 = 10.0;
/// Fewest pixels across an octave: four of its periods.
const LEAST_ACROSS: usize = 26;
/// Wave number at which an octave responds most, in reciprocals of its blur: `x² = (2/3) ln 4`.
const PEAK: f64 = 0.961_350_3;
/// A picture whose contrast is below this multiple of its steps carries no information.
const LEAST_STEPS: f64 = 2.0;

/// Relief of a material, within the band that its picture resolves and a finger feels as texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    /// Root mean square height `Sq` (ISO 25178-2), mm; for an albedo, under the assumption that its contrast is shading by a light 45
    /// degrees high.
    pub height_mm: f64,
    /// Root mean square gradient `Sdq`; for an albedo, under the same assumption.
    pub slope: f64,
    /// Shortest and longest period of the band, mm.
    pub band_mm: [f64; 2],
}

impl Relief {
    /// The relief in a picture.
    ///
    /// Octaves of the spectrum are differences of Gaussian blurs, each with twice the deviation of the one before. For a single wave with at
    /// least twice the shortest period of the band, the height is accurate to 6 % and the period to 15 % (tests/it/material.rs); at the
    /// shortest period the height is 12 % too low and the period 47 % too long. An albedo is read as linear shading: contrast is the slope
    /// towards the light times the cotangent of the light's elevation ([Kube 1988]), here 1, so that `slope² = 2 contrast²` on average over
    /// directions.
    ///
    /// # Errors
    /// A picture that varies by less than twice the noise of its steps, or that resolves no two octaves below 10 mm.
    pub fn of(picture: &MaterialPicture) -> Result<Self> {
        let octaves = octaves(picture);
        let [(finest, _), .., (coarsest, _)] = octaves[..] else {
            return Err(TextonError::NotTactile {
                finest_mm: period_mm(picture.pitch_mm),
                most_mm: MOST_MM,
            });
        };
        // Sums over octaves of the square of their gain D(x) = exp(-x²/2) - exp(-2x²), times x^-2, 1 and x^2: integrals over
        // ln x, divided by ln 2.
        let rougher = 0.5 * (4.0 * 4_f64.ln() - 5.0 * 2.5_f64.ln()) / LN_2;
        let (plain, smoother) = (0.5 * (25.0 / 16_f64).ln() / LN_2, 0.5 * 0.45 / LN_2);
        let sum = |weight: fn(f64) -> f64| {
            let terms = octaves.iter().map(|(s, power)| weight(*s) * power);
            terms.sum::<f64>()
        };
        let rms = (sum(|_| 1.0) / plain).sqrt();
        // The noise of the steps is uniform within one step.
        let least = LEAST_STEPS * picture.step / 12_f64.sqrt();
        if rms <= least || !rms.is_finite() {
            return Err(TextonError::Uniform { rms, least });
        }
        let [height, slope] = match picture.kind {
            PictureKind::Height => [rms, (sum(|s| s.powi(-2)) / rougher).sqrt()],
            PictureKind::Albedo => {
                let shading = 2_f64.sqrt() / mean(&picture.values);
                [(sum(|s| s * s) / smoother).sqrt(), rms].map(|x| x * shading)
            }
        };
        Ok(Self {
            height_mm: height,
            slope,
            band_mm: [finest, coarsest].map(period_mm),
        })
    }

    /// Root mean square wavelength `2 π Sq / Sdq`, mm: the period of a sine of the same height and slope.
    #[must_use]
    pub fn period_mm(&self) -> f64 {
        TAU * self.height_mm / self.slope
    }
}

/// Period to which an octave with this blur responds most, mm.
fn period_mm(blur_mm: f64) -> f64 {
    TAU * blur_mm / PEAK
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

/// Blur, mm, and mean square of each octave below 10 mm, from the finest.
fn octaves(picture: &MaterialPicture) -> Vec<(f64, f64)> {
    let mut octaves = Vec::new();
    let (mut columns, mut blur_mm) = (picture.columns, picture.pitch_mm);
    // The mean is removed, so that single precision is spent on the relief alone.
    let mean = mean(&picture.values);
    let about_mean = picture.values.iter().map(|v| (f64::from(*v) - mean) as f32);
    let about_mean: Vec<f32> = about_mean.collect();
    let mut values = blurred(&about_mean, columns, 1.0);
    while columns.min(values.len() / columns) >= LEAST_ACROSS && period_mm(blur_mm) <= MOST_MM {
        // Deviations add as squares: 1 and 3 make 2².
        let next = blurred(&values, columns, 3_f64.sqrt());
        let pairs = values.iter().zip(&next);
        let power: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
        octaves.push((blur_mm, power / values.len() as f64));
        let rows = next.chunks_exact(columns).step_by(2);
        values = rows
            .flat_map(|row| row.iter().step_by(2))
            .copied()
            .collect();
        columns = columns.div_ceil(2);
        blur_mm *= 2.0;
    }
    octaves
}

/// Blurred by a Gaussian, pixels; mirrored at the borders.
fn blurred(values: &[f32], columns: usize, deviation: f64) -> Vec<f32> {
    let reach = (3.5 * deviation).ceil() as usize;
    let bell = |i: usize| (-0.5 * (i as f64 / deviation).powi(2)).exp();
    let all = bell(0) + 2.0 * (1..=reach).map(bell).sum::<f64>();
    let kernel: Vec<f32> = (0..=reach).map(|i| (bell(i) / all) as f32).collect();
    let across = along_rows(values, columns, &kernel);
    along_rows(&across, values.len() / columns, &kernel)
}

/// Blurs along rows of this length, and transposes.
fn along_rows(values: &[f32], length: usize, kernel: &[f32]) -> Vec<f32> {
    let rows = values.len() / length;
    let reach = kernel.len() - 1;
    let mut out = vec![0.0; values.len()];
    let mut padded = vec![0.0; length + 2 * reach];
    for (y, row) in values.chunks_exact(length).enumerate() {
        padded[reach..reach + length].copy_from_slice(row);
        for i in 0..reach {
            padded[reach - 1 - i] = row[i];
            padded[reach + length + i] = row[length - 1 - i];
        }
        for x in 0..length {
            let here = &padded[x..=x + 2 * reach];
            let pairs = (1..=reach).map(|d| kernel[d] * (here[reach - d] + here[reach + d]));
            out[x * rows + y] = kernel[0] * here[reach] + pairs.sum::<f32>();
        }
    }
    out
}
