//! Where the tracker stands, from points that were measured in both frames.

use crate::{ContactError, RigidMap};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// A rigid map from point pairs, and how well it fits them.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The map, least squares over all pairs.
    pub a_from_b: RigidMap,
    /// Distance of each mapped point from its partner, m, in the order of the pairs.
    pub residuals_m: Vec<f64>,
}

/// Fewest pairs that fix a rigid map.
const FEWEST: usize = 3;
/// Points on one line leave the turn about it open: below this ratio of what fixes the turn to the
/// size of the cloud they count as such.
const COLLINEAR: f64 = 1e-9;
/// Sweeps of the eigenvalue iteration; it converges quadratically, in five or six.
const SWEEPS: usize = 50;

impl Calibration {
    /// From points known in both frames, such as the board's corners touched with a tracked
    /// finger: `(in a, in b)`, m. Three pairs that are not on one line are enough; more average
    /// noise out.
    ///
    /// Error: exact to rounding for exact pairs; with independent noise of standard deviation `s`
    /// a coordinate, the mean of `n` points is off by `s √(3 / n)`.
    /// Source: [Horn 1987], unit quaternions.
    ///
    /// # Errors
    /// NaN or infinity, fewer than three pairs, points on one line or all in one place.
    pub fn from_pairs(pairs: &[(DVec3, DVec3)]) -> Result<Self, ContactError> {
        if pairs.len() < FEWEST {
            return Err(ContactError::TooFewPairs {
                needed: FEWEST,
                got: pairs.len(),
            });
        }
        let finite = |p: &DVec3| p.to_array().into_iter().find(|x| !x.is_finite());
        if let Some(value) = pairs.iter().find_map(|(a, b)| finite(a).or(finite(b))) {
            return Err(ContactError::NonFinite {
                what: "point of a pair",
                value,
            });
        }
        let n = pairs.len() as f64;
        let mean = |pick: fn(&(DVec3, DVec3)) -> DVec3| {
            // Divided first: sums of large coordinates would overflow.
            pairs.iter().map(|p| pick(p) / n).sum::<DVec3>()
        };
        let (mean_a, mean_b) = (mean(|p| p.0), mean(|p| p.1));
        let size = pairs.iter().fold(0.0, |m: f64, (a, b)| {
            m.max((a - mean_a).abs().max_element())
                .max((b - mean_b).abs().max_element())
        });
        if !(size > 0.0 && size.is_finite()) {
            return Err(ContactError::Collinear { ratio: 0.0 });
        }
        // Sum of b aᵀ, of points about their means in units of the cloud.
        let mut s = DMat3::ZERO;
        for (a, b) in pairs {
            let (a, b) = ((a - mean_a) / size, (b - mean_b) / size);
            s += DMat3::from_cols(b * a.x, b * a.y, b * a.z);
        }
        let [sx, sy, sz] = [s.row(0), s.row(1), s.row(2)];
        let n4 = [
            [sx.x + sy.y + sz.z, sy.z - sz.y, sz.x - sx.z, sx.y - sy.x],
            [sy.z - sz.y, sx.x - sy.y - sz.z, sx.y + sy.x, sz.x + sx.z],
            [sz.x - sx.z, sx.y + sy.x, sy.y - sx.x - sz.z, sy.z + sz.y],
            [sx.y - sy.x, sz.x + sx.z, sy.z + sz.y, sz.z - sx.x - sy.y],
        ];
        let (values, vectors) = eigen(n4);
        let mut order = [0, 1, 2, 3];
        order.sort_by(|i, j| values[*j].total_cmp(&values[*i]));
        let ratio = (values[order[0]] - values[order[1]]) / values[order[0]].abs();
        if ratio.is_nan() || ratio <= COLLINEAR {
            return Err(ContactError::Collinear { ratio });
        }
        let [w, x, y, z] = [0, 1, 2, 3].map(|k| vectors[k][order[0]]);
        let turn = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        let a_from_b = RigidMap::from_affine(DAffine3 {
            matrix3: turn,
            translation: mean_a - turn * mean_b,
        })?;
        let residuals_m = pairs
            .iter()
            .map(|(a, b)| a_from_b.point(*b).distance(*a))
            .collect();
        Ok(Self {
            a_from_b,
            residuals_m,
        })
    }

    /// Root mean square of the residuals, m.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        let squares: f64 = self.residuals_m.iter().map(|r| r * r).sum();
        (squares / self.residuals_m.len() as f64).sqrt()
    }

    /// The worst pair, from 0, and its residual, m: the first to look at when the fit is bad.
    #[must_use]
    pub fn worst(&self) -> (usize, f64) {
        self.residuals_m
            .iter()
            .copied()
            .enumerate()
            .fold((0, 0.0), |worst, r| if r.1 > worst.1 { r } else { worst })
    }
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations.
fn eigen(mut a: [[f64; 4]; 4]) -> ([f64; 4], [[f64; 4]; 4]) {
    let mut v = [[0.0; 4]; 4];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..SWEEPS {
        let off: f64 = (0..4)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i][j].powi(2))
            .sum();
        if off == 0.0 {
            break;
        }
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                // The smaller root; for a huge theta its square overflows to infinity and t to 0.
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (before_q, from_q) = a.split_at_mut(q);
                for (x, y) in before_q[p].iter_mut().zip(&mut from_q[0]) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
                a[p][q] = 0.0;
                a[q][p] = 0.0;
                for row in &mut v {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    ([0, 1, 2, 3].map(|k| a[k][k]), v)
}
