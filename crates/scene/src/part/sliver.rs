//! Barycentric weights of slivers in double-double arithmetic.
//!
//! Numbers are unevaluated sums of two f64; sums and products after Dekker (1971) and Knuth, accurate to about 1e-31.

use super::triangle::Triangle;
use glam::DVec3;
use std::ops::{Add, Mul, Sub};

/// An unevaluated sum of two numbers, the second below the last digit of the first.
#[derive(Clone, Copy)]
struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    fn difference(a: f64, b: f64) -> Self {
        Self::sum(a, -b)
    }

    /// Exact.
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        Self {
            high,
            low: (a - (high - of_b)) + (b - of_b),
        }
    }

    /// Exact unless it overflows or underflows.
    fn product(a: f64, b: f64) -> Self {
        let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
        let high = a * b;
        Self {
            high,
            low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2,
        }
    }

    fn ratio(self, by: Self) -> f64 {
        let first = self.high / by.high;
        let rest = self
            - by * Self {
                high: first,
                low: 0.0,
            };
        first + rest.high / by.high
    }
}

/// Splits a number into two parts of 26 bits each.
fn halves(a: f64) -> (f64, f64) {
    let shifted = 134_217_729.0 * a;
    let first = shifted - (shifted - a);
    (first, a - first)
}

impl Add for Twofold {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (
            Self::sum(self.high, other.high),
            Self::sum(self.low, other.low),
        );
        let once = Self::sum(high.high, high.low + low.high);
        Self::sum(once.high, once.low + low.low)
    }
}

impl Sub for Twofold {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + Self {
            high: -other.high,
            low: -other.low,
        }
    }
}

impl Mul for Twofold {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let exact = Self::product(self.high, other.high);
        Self::sum(
            exact.high,
            exact.low + (self.high * other.low + self.low * other.high),
        )
    }
}

type Vector = [Twofold; 3];

fn from_to(a: DVec3, b: DVec3) -> Vector {
    [0, 1, 2].map(|i| Twofold::difference(b[i], a[i]))
}

fn dot(a: &Vector, b: &Vector) -> Twofold {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Weights of the corners at the foot of `p` in the plane of the triangle; their signs are right unless they are below
/// 1e-31 of the square of side over height.
pub(super) fn weights(p: DVec3, &[a, b, c]: &Triangle) -> [f64; 3] {
    let (ab, ac, ap) = (from_to(a, b), from_to(a, c), from_to(a, p));
    let (aa, cc, across) = (dot(&ab, &ab), dot(&ac, &ac), dot(&ab, &ac));
    let (d1, d2) = (dot(&ab, &ap), dot(&ac, &ap));
    let area = aa * cc - across * across;
    let wb = cc * d1 - across * d2;
    let wc = aa * d2 - across * d1;
    [(area - wb - wc).ratio(area), wb.ratio(area), wc.ratio(area)]
}

/// The foot of `p`, which lies inside; the first side must be the longest.
///
/// Along that side the result does not depend on the weights; across it the error is scaled by the small height.
pub(super) fn inside(p: DVec3, &[a, b, c]: &Triangle, [_, _, wc]: [f64; 3]) -> DVec3 {
    let (ab, ac) = (from_to(a, b), from_to(a, c));
    let foot_of_c = dot(&ab, &ac).ratio(dot(&ab, &ab));
    let foot_of_c = Twofold {
        high: foot_of_c,
        low: 0.0,
    };
    let height = [0, 1, 2].map(|i| (ac[i] - ab[i] * foot_of_c).high);
    let along = (b - a).dot(p - a) / a.distance_squared(b);
    a + (b - a) * along + DVec3::from_array(height) * wc.clamp(0.0, 1.0)
}
