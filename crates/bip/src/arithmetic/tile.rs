//! Vectors padded to whole tiles, for vectorisation by the compiler.

use pulp::{Arch, Simd, WithSimd};
use std::ops::{Deref, DerefMut};

/// Number of doubles in a tile.
pub(crate) const LANES: usize = 8;
/// `LANES` neighbouring columns of one row.
pub(crate) type Tile = [f64; LANES];

/// A tile aligned to a cache line, for the most used matrices: otherwise each wide access may touch two lines.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct AlignedTile(pub(crate) Tile);

impl AlignedTile {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);
}

impl Deref for AlignedTile {
    type Target = Tile;

    fn deref(&self) -> &Tile {
        &self.0
    }
}

impl DerefMut for AlignedTile {
    fn deref_mut(&mut self) -> &mut Tile {
        &mut self.0
    }
}

/// Limited to 256-bit vectors: with wider ones the compiler takes one column of many tiles at a time, with gathers and scatters. Code with explicit
/// vectors is dispatched to the widest.
pub(crate) fn vectorize<O: WithSimd>(operation: O) -> O::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Simd::vectorize(simd, operation);
    }
    Arch::new().dispatch(operation)
}

/// Number of tiles that hold `n` columns.
pub(crate) fn tiles(n: usize) -> usize {
    n.div_ceil(LANES)
}

/// `to += factor · from`, fused if the machine has such an instruction.
#[inline(always)]
pub(crate) fn add_multiple<S: Simd>(to: &mut Tile, factor: f64, from: &Tile) {
    for l in 0..LANES {
        to[l] = if S::IS_SCALAR {
            to[l] + factor * from[l]
        } else {
            factor.mul_add(from[l], to[l])
        };
    }
}

/// `to += a b`, lane by lane, fused under the same condition.
#[inline(always)]
pub(super) fn add_product<S: Simd>(to: &mut Tile, a: &Tile, b: &Tile) {
    for l in 0..LANES {
        to[l] = if S::IS_SCALAR {
            to[l] + a[l] * b[l]
        } else {
            a[l].mul_add(b[l], to[l])
        };
    }
}

/// Sum of the lanes, pairwise.
#[inline(always)]
pub(crate) fn lane_sum(t: &Tile) -> f64 {
    let mut t = *t;
    let mut half = LANES / 2;
    while half > 0 {
        for l in 0..half {
            t[l] += t[l + half];
        }
        half /= 2;
    }
    t[0]
}

/// Dot product of two padded vectors.
pub(super) fn tile_dot(a: &[AlignedTile], b: &[Tile]) -> f64 {
    let mut sum: Tile = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for ((s, a), b) in sum.iter_mut().zip(&a.0).zip(b) {
            *s += a * b;
        }
    }
    lane_sum(&sum)
}

/// Are all values finite? 0 x is zero or NaN, so the sum needs no branch per value.
pub(crate) fn all_finite(values: &[f64]) -> bool {
    values.iter().map(|x| 0.0 * x).sum::<f64>() == 0.0
}
