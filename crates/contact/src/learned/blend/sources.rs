//! The sources of evidence about the end of a reach, and the weights of their best combination.

use crate::learned::config::{Combination, Frame};
use glam::DVec3;

pub(in crate::learned) const SOURCES: usize = 5;

/// A source of evidence, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::learned) enum Source {
    /// The regression that uses the place in the room.
    Room,
    /// The regression relative to the start of the reach.
    Start,
    /// The interaction primitive.
    Primitive,
    /// The hand stays where it is: best at the end of a reach.
    Hold,
    /// Trees that correct a regression.
    Trees,
}

/// Predicted end by each source, m; `None` without a prediction.
pub(in crate::learned) type Ends = [Option<DVec3>; SOURCES];

/// Keeps the sources that a combination uses in a frame. `Primitive` falls back on the regressions where the primitive has no prediction.
pub(in crate::learned) fn of_combination(
    combination: Combination,
    frame: Frame,
    mut ends: Ends,
) -> Ends {
    let of_the_other: &[Source] = match frame {
        Frame::Both => &[],
        Frame::Room => &[Source::Start, Source::Trees],
        Frame::Start => &[Source::Room, Source::Primitive, Source::Trees],
    };
    for source in of_the_other {
        ends[*source as usize] = None;
    }
    let primitive = ends[Source::Primitive as usize];
    match combination {
        Combination::Regression => ends[Source::Primitive as usize] = None,
        Combination::Primitive if primitive.is_some() => {
            ends = [None; SOURCES];
            ends[Source::Primitive as usize] = primitive;
        }
        _ => {}
    }
    ends
}

/// One number for every pair of sources.
pub(in crate::learned) type Pairs = [[f64; SOURCES]; SOURCES];

/// Share of the least diagonal entry added to all: regularises weights that depend on small differences.
const SHRINKAGE: f64 = 0.03;

/// Non-negative weights with sum 1 that minimise `wᵀ M w` over the sources that are `there`. All zero if none is.
///
/// Error: exact for the sources that keep a weight; a source with a negative weight is dropped for good.
pub(in crate::learned) fn weights(moments: &Pairs, mut there: [bool; SOURCES]) -> [f64; SOURCES] {
    let mut least = f64::INFINITY;
    for k in 0..SOURCES {
        if there[k] {
            least = least.min(moments[k][k]);
        }
    }
    let shrinkage = SHRINKAGE * least.max(f64::MIN_POSITIVE);
    loop {
        let solved = solve(moments, shrinkage, there);
        let (mut lowest, mut value) = (SOURCES, 0.0);
        let mut sum = 0.0;
        for k in 0..SOURCES {
            if there[k] {
                if solved[k] < value {
                    (lowest, value) = (k, solved[k]);
                }
                sum += solved[k];
            }
        }
        if lowest < SOURCES {
            there[lowest] = false;
            continue;
        }
        return if sum > 0.0 && sum.is_finite() {
            solved.map(|w| w / sum)
        } else {
            let count = there.iter().filter(|t| **t).count().max(1) as f64;
            there.map(|t| if t { 1.0 / count } else { 0.0 })
        };
    }
}

/// Solves `(M + s I) w = 1` over the sources that are there, by Gaussian elimination; zero for the others.
#[expect(clippy::needless_range_loop, reason = "indices of a small matrix")]
fn solve(moments: &Pairs, shrinkage: f64, there: [bool; SOURCES]) -> [f64; SOURCES] {
    let mut a = *moments;
    let mut w = [1.0; SOURCES];
    for k in 0..SOURCES {
        if there[k] {
            a[k][k] += shrinkage;
        } else {
            for j in 0..SOURCES {
                (a[k][j], a[j][k]) = (0.0, 0.0);
            }
            (a[k][k], w[k]) = (1.0, 0.0);
        }
    }
    for k in 0..SOURCES {
        let pivot = a[k][k].max(1e-12 * shrinkage + f64::MIN_POSITIVE);
        for i in k + 1..SOURCES {
            let factor = a[i][k] / pivot;
            for j in k..SOURCES {
                a[i][j] -= factor * a[k][j];
            }
            w[i] -= factor * w[k];
        }
    }
    for k in (0..SOURCES).rev() {
        let known: f64 = (k + 1..SOURCES).map(|j| a[k][j] * w[j]).sum();
        w[k] = (w[k] - known) / a[k][k].max(1e-12 * shrinkage + f64::MIN_POSITIVE);
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(values: [f64; SOURCES]) -> Pairs {
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { values[i] } else { 0.0 }))
    }

    #[test]
    fn independent_sources_count_by_their_precision() {
        let w = weights(&diagonal([1.0, 4.0, 1e9, 1e9, 1e9]), [true; SOURCES]);
        assert!((w[0] / w[1] - 4.03 / 1.03).abs() < 1e-9, "{w:?}");
        assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // A missing source has no weight.
        let w = weights(&diagonal([1.0; SOURCES]), [false, true, false, true, false]);
        assert_eq!(w, [0.0, 0.5, 0.0, 0.5, 0.0]);
        assert_eq!(
            weights(&diagonal([1.0; SOURCES]), [false; SOURCES]),
            [0.0; SOURCES]
        );
    }

    #[test]
    fn a_worse_source_with_the_same_errors_gets_nothing() {
        let mut m = diagonal([1.0, 4.0, 9.0, 9.0, 9.0]);
        for (i, j) in [(0, 1), (1, 0)] {
            m[i][j] = 1.9;
        }
        let w = weights(&m, [true, true, false, false, false]);
        assert_eq!(w, [1.0, 0.0, 0.0, 0.0, 0.0]);
        // Weights stay finite and non-negative for zeros and NaN.
        for bad in [0.0, f64::NAN] {
            let w = weights(&diagonal([bad; SOURCES]), [true; SOURCES]);
            assert!(w.iter().all(|w| w.is_finite() && *w >= 0.0), "{w:?}");
        }
    }
}
