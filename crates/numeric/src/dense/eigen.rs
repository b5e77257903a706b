//! Symmetric eigenvalues.

/// Eigenvalues and eigenvectors of a symmetric `N × N` matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen<const N: usize> {
    /// Largest first.
    pub values: [f64; N],
    /// One unit vector a row, in the order of the values.
    pub vectors: [[f64; N]; N],
}

/// Sweeps after which the largest off-diagonal entry has long been at the level of rounding.
const SWEEPS: usize = 30;

/// Eigenvalues and eigenvectors of the symmetric part of a matrix, by Jacobi rotations.
///
/// Chosen over faster methods because it finds small eigenvalues of a scaled Gram matrix with high
/// relative accuracy and cannot fail: NaN comes out where NaN went in.
#[must_use]
pub fn symmetric_eigen<const N: usize>(a: &[[f64; N]; N]) -> Eigen<N> {
    let mut a: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (a[i][j] + a[j][i])));
    let mut v: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..N {
            for q in p + 1..N {
                turned |= rotate(&mut a, &mut v, p, q);
            }
        }
        // NaN is never small.
        if !turned || a.as_flattened().iter().any(|x| !x.is_finite()) {
            break;
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    Eigen {
        values: order.map(|i| a[i][i]),
        vectors: order.map(|i| v[i]),
    }
}

/// One Jacobi rotation that clears `a[p][q]`; the rows of `v` turn along. `false` if the entry was
/// at the level of the rounding of its two diagonal entries, which then keep their digits.
fn rotate<const N: usize>(
    a: &mut [[f64; N]; N],
    v: &mut [[f64; N]; N],
    p: usize,
    q: usize,
) -> bool {
    let rounding = 0.5 * f64::EPSILON * a[p][p].abs().sqrt() * a[q][q].abs().sqrt();
    if a[p][q].abs() <= rounding {
        return false;
    }
    let Some((c, s)) = rotation(a[p][p], a[q][q], a[p][q]) else {
        return false;
    };
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..N {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
    }
    // What is left there is rounding.
    if a[p][q].is_finite() {
        (a[p][q], a[q][p]) = (0.0, 0.0);
    }
    true
}

/// Cosine and sine that clear the off-diagonal entry of a symmetric 2 × 2 matrix; `None` where it is clear.
pub(super) fn rotation(app: f64, aqq: f64, apq: f64) -> Option<(f64, f64)> {
    if apq == 0.0 {
        return None;
    }
    let theta = (aqq - app) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    Some((c, t * c))
}
