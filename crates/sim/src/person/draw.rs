//! The kinds of random numbers that habits and reaches are drawn with.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Deviations beyond this many standard deviations are cut off: nobody is that odd.
const FURTHEST_SD: f64 = 3.0;

pub(super) struct Draw(Pcg64);

impl Draw {
    /// A stream of its own for each purpose: a trait that is added changes none of the others.
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

    /// Normal, cut off.
    pub(super) fn bounded(&mut self) -> f64 {
        self.normal().clamp(-FURTHEST_SD, FURTHEST_SD)
    }

    /// Factor about 1 with this relative scatter, at most three times it away.
    pub(super) fn scatter(&mut self, sd: f64) -> f64 {
        (sd * self.bounded()).exp()
    }
}

/// Number of a stream, scrambled: neighbouring numbers give unrelated ones. Source: the finalizer
/// of SplitMix64, Steele, Lea and Flood 2014, Fast splittable pseudorandom number generators.
pub(super) const fn scrambled(number: u64) -> u64 {
    let z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
