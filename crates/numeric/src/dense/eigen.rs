//! Symmetric eigenvalues.

use super::Matrix;

/// Eigenvalues and eigenvectors of a symmetric `N × N` matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen<const N: usize> {
    /// Largest first.
    pub values: [f64; N],
    /// One unit vector per row, in the order of the values.
    pub vectors: [[f64; N]; N],
}

/// As [`Eigen`], for a matrix whose size is known only at run time.
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricEigen {
    /// Largest first.
    pub values: Vec<f64>,
    /// One unit vector per row, in the order of the values.
    pub vectors: Matrix,
}

/// Maximum number of sweeps; convergence to rounding needs far fewer.
const SWEEPS: usize = 30;

/// Eigenvalues and eigenvectors of the symmetric part of a matrix, by Jacobi rotations.
///
/// Chosen over faster methods because it finds small eigenvalues of a scaled Gram matrix with high
/// relative accuracy and cannot fail: NaN in gives NaN out.
///
/// Entries may be as large as 1e307 / `N`, so that no eigenvalue overflows; those below 1e-292 lose digits.
#[must_use]
pub fn symmetric_eigen<const N: usize>(a: &[[f64; N]; N]) -> Eigen<N> {
    let mut a: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * a[i][j] + 0.5 * a[j][i]));
    let mut v: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    diagonalize(a.as_flattened_mut(), v.as_flattened_mut(), N);
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    Eigen {
        values: order.map(|i| a[i][i]),
        vectors: order.map(|i| v[i]),
    }
}

impl SymmetricEigen {
    /// Decomposes the symmetric part of a matrix by the method of [`symmetric_eigen`].
    ///
    /// # Panics
    /// If the matrix is not square.
    #[must_use]
    pub fn new(a: &Matrix) -> Self {
        let n = a.rows();
        assert_eq!(a.columns(), n, "columns of a symmetric matrix");
        let mut part =
            Matrix::from_fn(n, n, |i, j| 0.5 * a[(i, j)] + 0.5 * a[(j, i)]).into_entries();
        let mut v = Matrix::identity(n).into_entries();
        diagonalize(&mut part, &mut v, n);
        let value = |i: usize| part[i * n + i];
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| value(j).total_cmp(&value(i)));
        Self {
            values: order.iter().map(|&i| value(i)).collect(),
            vectors: Matrix::from_fn(n, n, |i, j| v[order[i] * n + j]),
        }
    }
}

/// Rotates a symmetric `n × n` matrix, row by row, until it is diagonal; rotates the rows of `v` along.
#[inline]
fn diagonalize(a: &mut [f64], v: &mut [f64], n: usize) {
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                turned |= rotate(a, v, n, p, q);
            }
        }
        // Stop on NaN: it never converges.
        if !turned || a.iter().any(|x| !x.is_finite()) {
            break;
        }
    }
}

/// One Jacobi rotation that clears entry `(p, q)` of `a`; rotates the rows of `v` along. `false`, without a
/// rotation, if the entry is at the rounding level of its two diagonal entries. The largest entry of the matrix
/// does not matter here, so that small eigenvalues keep their digits.
#[inline]
fn rotate(a: &mut [f64], v: &mut [f64], n: usize, p: usize, q: usize) -> bool {
    let (pp, qq, pq) = (p * n + p, q * n + q, p * n + q);
    let rounding = 0.5 * f64::EPSILON * a[pp].abs().sqrt() * a[qq].abs().sqrt();
    if a[pq].abs() <= rounding {
        return false;
    }
    let Some((c, s)) = rotation(a[pp], a[qq], a[pq]) else {
        return false;
    };
    let turned = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
    for row in a.chunks_exact_mut(n) {
        (row[p], row[q]) = turned(row[p], row[q]);
    }
    for k in 0..n {
        let (x, y) = (p * n + k, q * n + k);
        (a[x], a[y]) = turned(a[x], a[y]);
        (v[x], v[y]) = turned(v[x], v[y]);
    }
    // The remaining entry is rounding.
    if a[pq].is_finite() {
        (a[pq], a[q * n + p]) = (0.0, 0.0);
    }
    true
}

/// Cosine and sine that clear the off-diagonal entry of a symmetric 2 × 2 matrix; `None` if it is already zero.
pub(super) fn rotation(app: f64, aqq: f64, apq: f64) -> Option<(f64, f64)> {
    if apq == 0.0 {
        return None;
    }
    let theta = (aqq - app) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    Some((c, t * c))
}
