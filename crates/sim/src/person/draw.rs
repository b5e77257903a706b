//! Random numbers for habits and reaches.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Deviations are truncated at this many standard deviations.
const FURTHEST_SD: f64 = 3.0;

pub(super) struct Draw(Pcg64);

impl Draw {
    /// A separate stream per purpose, so that adding a trait does not change the others.
    pub(super) fn new(seed: u64, purpose: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed ^ purpose))
    }

    pub(super) fn within(&mut self, [lo, hi]: [f64; 2]) -> f64 {
        lo + (hi - lo) * self.0.random::<f64>()
    }

    pub(super) fn chance(&mut self, share: f64) -> bool {
        self.0.random::<f64>() < share
    }

    pub(super) fn index(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    pub(super) fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Truncated normal.
    pub(super) fn bounded(&mut self) -> f64 {
        self.normal().clamp(-FURTHEST_SD, FURTHEST_SD)
    }

    /// Log-normal factor about 1 with this relative scatter, truncated at three standard deviations.
    pub(super) fn scatter(&mut self, sd: f64) -> f64 {
        (sd * self.bounded()).exp()
    }
}

/// Scrambles a number: neighbouring numbers give unrelated results. Source: the finalizer of
/// SplitMix64, Steele, Lea and Flood 2014, Fast splittable pseudorandom number generators.
pub(super) const fn scrambled(number: u64) -> u64 {
    let z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
