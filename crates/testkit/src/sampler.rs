//! Reproducible random numbers.

use glam::{DMat3, DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Seeded source of numbers, directions, rotations and points: one seed, one sequence.
#[derive(Debug, Clone)]
pub struct Sampler {
    generator: Pcg64,
}

impl Sampler {
    /// Starts the sequence of `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            generator: Pcg64::seed_from_u64(seed),
        }
    }

    /// Uniform between `lo` and `hi` (either may be hit by rounding).
    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.generator.random::<f64>()
    }

    /// Uniform in `0..n`.
    ///
    /// # Panics
    /// When `n` is 0.
    pub fn index(&mut self, n: usize) -> usize {
        self.generator.random_range(0..n)
    }

    /// A fair coin.
    pub fn bool(&mut self) -> bool {
        self.generator.random()
    }

    /// Standard normal: mean 0, variance 1.
    ///
    /// Source: Box and Muller 1958; of the pair only the cosine half is used.
    pub fn normal(&mut self) -> f64 {
        // 1 - u lies in (0, 1], so the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.generator.random::<f64>()).ln()).sqrt();
        radius * self.uniform(0.0, TAU).cos()
    }

    /// Three standard normal components.
    pub fn normal_vector(&mut self) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.normal()))
    }

    /// Uniform on the unit sphere.
    pub fn unit_vector(&mut self) -> DVec3 {
        // Heights on a sphere are uniform (Archimedes).
        let z = self.uniform(-1.0, 1.0);
        let (sin, cos) = self.uniform(0.0, TAU).sin_cos();
        let radius = ((1.0 - z) * (1.0 + z)).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }

    /// Uniform on SO(3).
    ///
    /// Source: Shoemake 1992, Graphics Gems III, "Uniform random rotations".
    pub fn rotation(&mut self) -> DMat3 {
        let share = self.uniform(0.0, 1.0);
        let (sin_a, cos_a) = self.uniform(0.0, TAU).sin_cos();
        let (sin_b, cos_b) = self.uniform(0.0, TAU).sin_cos();
        let (r, s) = ((1.0 - share).sqrt(), share.sqrt());
        DMat3::from_quat(DQuat::from_xyzw(r * sin_a, r * cos_a, s * sin_b, s * cos_b).normalize())
    }

    /// One uniform number in each of the `ranges`, for instance joint limits.
    pub fn within(&mut self, ranges: &[(f64, f64)]) -> Vec<f64> {
        ranges
            .iter()
            .map(|&(lo, hi)| self.uniform(lo, hi))
            .collect()
    }

    /// [`within`](Self::within) for a number of ranges known at compile time.
    pub fn array_within<const N: usize>(&mut self, ranges: [(f64, f64); N]) -> [f64; N] {
        ranges.map(|(lo, hi)| self.uniform(lo, hi))
    }

    /// Uniform in the box with the corners `min` and `max`.
    pub fn point_in_box(&mut self, min: DVec3, max: DVec3) -> DVec3 {
        DVec3::new(
            self.uniform(min.x, max.x),
            self.uniform(min.y, max.y),
            self.uniform(min.z, max.z),
        )
    }
}

/// Seeds of a test of arbitrary length: `HWALL_SEEDS=FROM..TO` from the environment, else `nominal`.
///
/// # Panics
/// If `HWALL_SEEDS` is not such a range.
#[must_use]
pub fn seeds(nominal: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(text) = std::env::var("HWALL_SEEDS") else {
        return nominal;
    };
    let ends = text
        .split_once("..")
        .map(|(from, to)| (from.parse(), to.parse()));
    match ends {
        Some((Ok(from), Ok(to))) => from..to,
        _ => panic!("HWALL_SEEDS is {text:?}, not a range such as 1000..2000"),
    }
}
