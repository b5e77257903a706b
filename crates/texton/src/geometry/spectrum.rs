//! The height of a texture as a sum of waves.

use super::layout::Layout;
use super::texton::{Texton, TextonShape};
use super::texture::Texture;
use glam::{DVec2, dvec2};
use std::f64::consts::TAU;

/// One wave of a texture's height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Wave vector along the long and the short axis, rad/mm.
    pub wave_rad_per_mm: DVec2,
    /// Amplitude `c` of `c cos (k · p)`, mm; `k` and `-k` are two waves.
    pub amplitude_mm: f64,
}

/// Slices of a cone in its integral over the height.
const SLICES: usize = 32;

impl Texton {
    /// Fourier transform of the bump's height, `∫∫ z(p) cos (k · p) dp`, mm³, at a wave vector k, rad/mm.
    ///
    /// For a hemiellipsoid it is `2 π a b h (sin s - s cos s) / s³` with `s = |(a kx, b ky)|`; for a cone
    /// it is the integral over its slices, ellipses with `2 π a b J₁(s) / s`, by the midpoint rule
    /// (relative error below 1e-3 up to `s` = 10).
    #[must_use]
    pub fn spectrum_mm3(&self, wave_rad_per_mm: DVec2) -> f64 {
        let DVec2 { x: kx, y: ky } = wave_rad_per_mm;
        let [a, b] = self.radii().to_array();
        let h = self.height_mm();
        match self.shape() {
            TextonShape::Hemiellipsoid => {
                let s = (a * kx).hypot(b * ky);
                // Below this, cancellation costs more than the truncated series.
                let shape = if s < 0.03 {
                    (1.0 - s * s / 10.0) / 3.0
                } else {
                    (s.sin() - s * s.cos()) / s.powi(3)
                };
                TAU * a * b * h * shape
            }
            TextonShape::TruncatedCone { .. } => {
                let [c, d] = self.top_radii().to_array();
                let slice = |i: usize| {
                    let up = (i as f64 + 0.5) / SLICES as f64;
                    let (a, b) = (a + (c - a) * up, b + (d - b) * up);
                    let s = (a * kx).hypot(b * ky);
                    let shape = if s < 1e-6 { 0.5 } else { libm::j1(s) / s };
                    TAU * a * b * shape
                };
                h / SLICES as f64 * (0..SLICES).map(slice).sum::<f64>()
            }
        }
    }
}

/// Largest multiple of the fundamental wave number along each axis: for bumps of a millimetre, waves of a micrometre. Without
/// this bound the sum for an infinite wave number would never end.
const MOST_MULTIPLES: i64 = 1000;

impl Texture {
    /// Waves of the height up to a wave number, rad/mm, without the mean height, and up to the thousandth multiple of
    /// the fundamental wave number along each axis.
    ///
    /// `z(p) = mean + Σ c cos (k · p)`, the middle of a bump at the origin.
    pub fn harmonics(&self, most_rad_per_mm: f64) -> impl Iterator<Item = Harmonic> {
        let [long_mm, short_mm] = self.layout().pitch_mm();
        // A staggered grid repeats after two rows; half of its waves cancel.
        let (rows, staggered) = match self.layout() {
            Layout::Rectangular { .. } => (1.0, false),
            Layout::Staggered { .. } => (2.0, true),
        };
        let (kx, ky) = (TAU / long_mm, TAU / (rows * short_mm));
        let most = most_rad_per_mm;
        let multiples = |of: f64| ((most / of).floor() as i64).clamp(0, MOST_MULTIPLES);
        let (columns, lines) = (multiples(kx), multiples(ky));
        let area_mm2 = self.layout().cell_area_mm2();
        let texton = *self.texton();
        (-columns..=columns)
            .flat_map(move |m| (-lines..=lines).map(move |n| (m, n)))
            .filter(move |&(m, n)| (m, n) != (0, 0) && !(staggered && (m + n) % 2 != 0))
            .map(move |(m, n)| dvec2(m as f64 * kx, n as f64 * ky))
            .filter(move |k| k.x.hypot(k.y) <= most)
            .map(move |wave_rad_per_mm| Harmonic {
                wave_rad_per_mm,
                amplitude_mm: texton.spectrum_mm3(wave_rad_per_mm) / area_mm2,
            })
    }
}
