//! Synthesized surfaces of named materials whose roughness was published.

use super::picture::{MaterialPicture, PictureKind};
use super::relief::Relief;
use crate::error::Result;
use MaterialSeries::{Grating, Sandpaper};
use std::f64::consts::TAU;

/// Pixels of a synthesized surface each way.
const SIDE: usize = 256;
/// Pixels across a grain or a period, so that both lie in the middle of the band.
const ACROSS: f64 = 16.3;
/// Sandpaper grades of FEPA 43-1 and 43-2 (ISO 6344), and the mean size of their grains, um.
const GRADES: [u32; 15] = [
    24, 30, 36, 40, 50, 60, 80, 100, 120, 150, 180, 220, 240, 280, 320,
];
const GRAINS_UM: [f64; 15] = [
    764.0, 642.0, 538.0, 425.0, 336.0, 269.0, 201.0, 162.0, 125.0, 97.0, 82.0, 68.0, 58.5, 52.2,
    46.2,
];
/// Size of the grains of P80, um: the unit of roughness.
const UNIT_UM: f64 = 201.0;
/// Stevens' exponent of tactual roughness over grain size.
const STEVENS: f64 = 1.5;
/// Grooves and ridges, mm, within the published range: periods up to 2 mm, ridges up to 1 mm.
const GROOVES_MM: [f64; 7] = [0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0];
const RIDGES_MM: [f64; 4] = [0.0, 0.25, 0.5, 1.0];
/// Smaller magnitudes of the published equation are within its scatter.
const LEAST_MAGNITUDE: f64 = 0.05;
/// Lights under which each surface is shown.
const LIGHTS: usize = 3;

/// A published series of surfaces, with a unit of magnitude of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MaterialSeries {
    /// Coated abrasives by FEPA grade; `R = (grain / 201 um)^1.5` [Stevens 1962].
    Sandpaper,
    /// Grooves with walls at 45 degrees; `R = 1.6 GW - 0.5 RW - 0.25 GW²` [Yoshioka 2001], beyond the 0.2 of a smooth surface.
    Grating,
}

impl MaterialSeries {
    /// Both series.
    pub const ALL: [Self; 2] = [Self::Sandpaper, Self::Grating];

    /// Name of the series in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sandpaper => "sandpaper",
            Self::Grating => "grating",
        }
    }
}

/// A material of the calibration: a synthesized surface, its pictures, and its published roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialSample {
    /// Name of the material.
    pub name: String,
    /// Series in which it was published.
    pub series: MaterialSeries,
    /// Published roughness, in the unit of its series.
    pub magnitude: f64,
    /// Relief in its pictures of each kind: one of its heights, and several of the surface under different lights.
    pub reliefs: [Vec<Relief>; 2],
    /// Predictions from these pictures when it is left out of the fit.
    pub left_out: [Vec<f64>; 2],
}

/// All samples, without predictions.
pub(super) fn samples() -> Result<Vec<MaterialSample>> {
    let mut samples = Vec::new();
    for (i, (grade, grain_um)) in GRADES.iter().zip(GRAINS_UM).enumerate() {
        let (name, pitch_mm) = (format!("P{grade}"), 1e-3 * grain_um / ACROSS);
        let magnitude = (grain_um / UNIT_UM).powf(STEVENS);
        let heights = grains(pitch_mm, 100 * i);
        samples.push(sample(name, Sandpaper, magnitude, pitch_mm, &heights)?);
    }
    for (groove, ridge) in GROOVES_MM.iter().flat_map(|g| RIDGES_MM.map(|r| (*g, r))) {
        let magnitude = 1.6 * groove - 0.5 * ridge - 0.25 * groove * groove;
        if groove + ridge <= 2.0 && magnitude > LEAST_MAGNITUDE {
            let name = format!("grooves {groove}, ridges {ridge} mm");
            let pitch_mm = (groove + ridge) / ACROSS;
            let heights = grooves(groove, ridge, pitch_mm);
            samples.push(sample(name, Grating, magnitude, pitch_mm, &heights)?);
        }
    }
    Ok(samples)
}

fn sample(
    name: String,
    series: MaterialSeries,
    magnitude: f64,
    pitch_mm: f64,
    heights: &[f64],
) -> Result<MaterialSample> {
    let relief =
        |kind, values| Relief::of(&MaterialPicture::new(kind, SIDE, pitch_mm, values, 0.0)?);
    // Lights differ from sample to sample: 20 to 70 degrees high, from any side.
    let letters = name.bytes();
    let seed = letters.fold(1, |sum, byte| (7 * sum + usize::from(byte)) % 10_000);
    let shaded = (seed..seed + LIGHTS).map(|light| {
        let high_rad = (20.0 + 50.0 * spread(light, 2)).to_radians();
        let values = shade(heights, pitch_mm, high_rad, TAU * spread(light, 3));
        relief(PictureKind::Albedo, values)
    });
    let shaded = shaded.collect::<Result<_>>()?;
    let values = heights.iter().map(|h| *h as f32).collect();
    Ok(MaterialSample {
        name,
        series,
        magnitude,
        reliefs: [vec![relief(PictureKind::Height, values)?], shaded],
        left_out: [Vec::new(), Vec::new()],
    })
}

/// Member `i` of the van der Corput sequence of a base: evenly spread over 0 to 1.
fn spread(mut i: usize, base: usize) -> f64 {
    let (mut sum, mut digit) = (0.0, 1.0);
    while i > 0 {
        digit /= base as f64;
        sum += digit * (i % base) as f64;
        i /= base;
    }
    sum
}

/// Heights of grains, mm: half balls of 0.8 to 1.2 times the mean size, evenly scattered, that cover half of the backing (an assumption).
fn grains(pitch_mm: f64, seed: usize) -> Vec<f64> {
    let mut heights = vec![0.0_f64; SIDE * SIDE];
    let side = SIDE as f64;
    let count = (0.64 * (side / ACROSS).powi(2)) as usize;
    for i in seed + 1..=seed + count {
        let [x, y] = [spread(i, 2), spread(i, 3)].map(|at| (at * side) as i64);
        let radius = 0.5 * ACROSS * (0.8 + 0.4 * spread(i, 5));
        let reach = radius.ceil() as i64;
        for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
            let [column, row] = [x + dx, y + dy].map(|at| at.rem_euclid(SIDE as i64) as usize);
            let above = radius * radius - (dx * dx + dy * dy) as f64;
            let height = &mut heights[row * SIDE + column];
            *height = height.max(pitch_mm * above.max(0.0).sqrt());
        }
    }
    heights
}

/// Grooves along y between flat ridges, mm. Other walls would change only the series' own unit of magnitude.
fn grooves(groove_mm: f64, ridge_mm: f64, pitch_mm: f64) -> Vec<f64> {
    let height = |k: usize| {
        let at = ((k % SIDE) as f64 + 0.5) * pitch_mm % (groove_mm + ridge_mm);
        -at.min(groove_mm - at).max(0.0)
    };
    (0..SIDE * SIDE).map(height).collect()
}

/// Brightness of a matt surface under a light, as an eight-bit picture holds it; without cast shadows.
fn shade(heights: &[f64], pitch_mm: f64, high_rad: f64, from_rad: f64) -> Vec<f32> {
    let ((sin, cos), (y, x)) = (high_rad.sin_cos(), from_rad.sin_cos());
    let at = |i: usize, j: usize| heights[j.min(SIDE - 1) * SIDE + i.min(SIDE - 1)];
    let brightness = |k: usize| {
        let (i, j) = (k % SIDE, k / SIDE);
        let dx = 0.5 * (at(i + 1, j) - at(i.saturating_sub(1), j)) / pitch_mm;
        let dy = 0.5 * (at(i, j + 1) - at(i, j.saturating_sub(1))) / pitch_mm;
        let lit = (sin - cos * (x * dx + y * dy)) / (1.0 + dx * dx + dy * dy).sqrt();
        (lit.max(0.0) * 255.0).round() as f32 / 255.0
    };
    (0..SIDE * SIDE).map(brightness).collect()
}
