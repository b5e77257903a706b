//! Quantiles as functions of the remaining distance.

use super::model::{BetweenWays, KNOTS};
use super::sizes::REGION_SHARES;

/// One error of a prediction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Miss {
    pub(super) at: BetweenWays,
    /// Index of the touch.
    pub(super) touch: usize,
    /// Logarithms of the squared distance in standard deviations, as it counts for each region.
    pub(super) logarithms: [f64; REGION_SHARES.len()],
    /// The weights of all samples of a touch add up to 1.
    pub(super) weight: f64,
}

/// Iterations, and the smoothing of the loss's corner in the first and second half of them.
const ROUNDS: usize = 60;
const CORNERS: [f64; 2] = [0.1, 0.02];
/// Weight of the prior, in touches.
const PRIOR_TOUCHES: f64 = 0.03;
/// Weight of the smoothness between neighbouring knots, in touches.
const ALIKE_TOUCHES: f64 = 0.1;

/// The `share` quantile of the errors as they count for a `region`, linear between the knots: quantile regression [Koenker 1978] by quadratic
/// majorisation of the absolute value [Hunter 2000]. Knots without data follow their neighbours; without any data, `expected`.
pub(super) fn quantiles(misses: &[Miss], region: usize, share: f64, expected: f64) -> [f64; KNOTS] {
    let mut found = [expected; KNOTS];
    for round in 0..ROUNDS {
        let corner = CORNERS[usize::from(2 * round >= ROUNDS)];
        // Tridiagonal: an error involves two neighbouring knots.
        let mut diagonal = [PRIOR_TOUCHES; KNOTS];
        let mut beside = [0.0; KNOTS];
        let mut right = [PRIOR_TOUCHES * expected; KNOTS];
        for k in 1..KNOTS {
            diagonal[k - 1] += ALIKE_TOUCHES;
            diagonal[k] += ALIKE_TOUCHES;
            beside[k - 1] -= ALIKE_TOUCHES;
        }
        for miss in misses {
            let (k, b) = (miss.at.before, miss.at.next_weight);
            let a = 1.0 - b;
            let logarithm = miss.logarithms[region];
            let off = logarithm - (a * found[k] + b * found[k + 1]);
            let weight = miss.weight / (corner + off.abs());
            let pull = weight * logarithm + (2.0 * share - 1.0) * miss.weight;
            diagonal[k] += weight * a * a;
            diagonal[k + 1] += weight * b * b;
            beside[k] += weight * a * b;
            right[k] += a * pull;
            right[k + 1] += b * pull;
        }
        found = solved(diagonal, beside, right);
    }
    found
}

/// Solves a symmetric tridiagonal system with a dominant diagonal; `beside[k]` couples k and k + 1.
fn solved(
    mut diagonal: [f64; KNOTS],
    beside: [f64; KNOTS],
    mut right: [f64; KNOTS],
) -> [f64; KNOTS] {
    for k in 1..KNOTS {
        let factor = beside[k - 1] / diagonal[k - 1];
        diagonal[k] -= factor * beside[k - 1];
        right[k] -= factor * right[k - 1];
    }
    right[KNOTS - 1] /= diagonal[KNOTS - 1];
    for k in (0..KNOTS - 1).rev() {
        right[k] = (right[k] - beside[k] * right[k + 1]) / diagonal[k];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_that_changes_with_the_way_is_found() {
        // Uniform from 0 to the level of the distance.
        let level = |way_m: f64| 1.0 + (way_m + 5e-3).ln();
        let ways_m = [0.01, 0.03, 0.06, 0.12, 0.25];
        let misses: Vec<Miss> = (0..5000)
            .map(|i| Miss {
                at: BetweenWays::of(ways_m[i % 5]),
                touch: i,
                logarithms: [level(ways_m[i % 5]) * ((i / 5) as f64 + 0.5) / 1000.0; 3],
                weight: 0.1,
            })
            .collect();
        for share in [0.5, 0.7, 0.9] {
            let found = quantiles(&misses, 1, share, 0.0);
            for (knot, way_m) in (1..).zip(ways_m) {
                // For negative levels the quantile counts from the other end.
                let level = level(way_m);
                let expected = level * if level < 0.0 { 1.0 - share } else { share };
                assert!((found[knot] - expected).abs() < 0.05, "{share} {way_m}");
            }
            // Outside the data, the value is about that of the nearest knot.
            assert!((found[0] - found[1]).abs() < 0.8 && (found[6] - found[5]).abs() < 0.8);
        }
    }

    #[test]
    fn without_errors_it_is_what_was_expected() {
        for found in quantiles(&[], 1, 0.7, 0.88) {
            assert!((found - 0.88).abs() < 1e-9);
        }
    }
}
