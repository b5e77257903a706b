//! Singular values.

use super::eigen::rotation;
use super::matrix::add_multiple;
use super::{Matrix, dot};
use std::fmt;

/// Singular values that were not found: the matrix holds NaN or infinity, or its entries are so large
/// or small that their squares are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotConverged {
    /// Rows of the matrix.
    pub rows: usize,
    /// Columns of the matrix.
    pub columns: usize,
}

impl fmt::Display for NotConverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, columns } = self;
        write!(f, "no singular values of a {rows} x {columns} matrix")
    }
}

impl std::error::Error for NotConverged {}

/// Thin singular value decomposition `A = left · diag(singular) · rightᵀ`, `k = min(rows, columns)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Svd {
    /// `rows × k`; columns are orthonormal.
    pub left: Matrix,
    /// Not negative, largest first.
    pub singular: Vec<f64>,
    /// `columns × k`; columns are orthonormal.
    pub right: Matrix,
}

/// Sweeps: ten suffice for any matrix seen; convergence is quadratic.
const SWEEPS: usize = 60;

impl Svd {
    /// By one-sided Jacobi rotations of the triangular factor of a reduction with pivots.
    ///
    /// Error: each singular value within some `n ε` of itself for a matrix whose columns are badly scaled but
    /// otherwise well conditioned, `n ε ‖A‖` in general. Source: [Demmel 1992], algorithm 4.1, on the
    /// transposed factor of a Householder reduction with column pivoting as in [Drmač 2008].
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn thin(a: &Matrix) -> Result<Self, NotConverged> {
        let failed = NotConverged {
            rows: a.rows(),
            columns: a.columns(),
        };
        if a.entries().iter().any(|x| !x.is_finite()) {
            return Err(failed);
        }
        // Scaled, so that no square overflows or vanishes.
        let largest = a.entries().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let scale = if largest > 0.0 { largest } else { 1.0 };
        let tall = a.rows() >= a.columns();
        let scaled = if tall {
            Matrix::from_fn(a.columns(), a.rows(), |i, j| a[(j, i)] / scale)
        } else {
            Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] / scale)
        };
        let (long, singular, short) = decomposed(scaled).ok_or(failed)?;
        let (left, right) = if tall { (long, short) } else { (short, long) };
        Ok(Self {
            left: left.transpose(),
            singular: singular.into_iter().map(|s| s * scale).collect(),
            right: right.transpose(),
        })
    }

    /// Number of singular values above `tolerance` times the largest.
    #[must_use]
    pub fn rank(&self, tolerance: f64) -> usize {
        let largest = self.singular.first().copied().unwrap_or(0.0);
        let counts = |s: &&f64| **s > tolerance * largest;
        self.singular.iter().take_while(counts).count()
    }
}

/// Of `k` vectors (rows) of length `m >= k`: vectors on the long side (`k × m`), singular values, vectors on the short
/// side (`k × k`), one a row.
fn decomposed(mut vectors: Matrix) -> Option<(Matrix, Vec<f64>, Matrix)> {
    let (k, m) = (vectors.rows(), vectors.columns());
    let Reduction { reflectors, order } = reduce(&mut vectors);
    // What is left is triangular, the largest first. Rotations of its rows converge in few sweeps.
    let mut work = Matrix::from_fn(k, k, |i, j| if i <= j { vectors[(j, i)] } else { 0.0 });
    let mut turned = Matrix::identity(k);
    let mut converged = k < 2;
    for _ in 0..SWEEPS {
        if converged {
            break;
        }
        converged = true;
        for p in 0..k {
            for q in p + 1..k {
                converged &= !orthogonalized(&mut work, &mut turned, p, q);
            }
        }
    }
    if !converged {
        return None;
    }
    let lengths: Vec<f64> = (0..k).map(|i| length(work.row(i))).collect();
    let mut by_size: Vec<usize> = (0..k).collect();
    by_size.sort_by(|&i, &j| lengths[j].total_cmp(&lengths[i]));
    let mut long = Matrix::zeros(k, m);
    let mut short = Matrix::zeros(k, k);
    for (to, &from) in by_size.iter().enumerate() {
        let row = long.row_mut(to);
        row[..k].copy_from_slice(turned.row(from));
        for (j, r) in reflectors.iter().enumerate().rev() {
            r.apply(&mut row[j..]);
        }
        if lengths[from] > 0.0 {
            for (x, &at) in work.row(from).iter().zip(&order) {
                short[(to, at)] = x / lengths[from];
            }
        } else {
            complete(&mut short, to);
        }
    }
    let singular = by_size.iter().map(|&i| lengths[i]).collect();
    Some((long, singular, short))
}

/// Makes a row a unit vector that is perpendicular to the orthonormal rows before it.
fn complete(rows: &mut Matrix, at: usize) {
    let (before, row) = rows.split_at_row_mut(at);
    let columns = row.len();
    for start in 0..columns {
        row.fill(0.0);
        row[start] = 1.0;
        // Twice: the first time loses digits where the unit vector nearly lies in their span.
        for other in before
            .chunks_exact(columns)
            .chain(before.chunks_exact(columns))
        {
            add_multiple(row, -dot(other, row), other);
        }
        let norm = length(row);
        // One of the unit vectors keeps at least this much.
        if norm * norm * columns as f64 > 0.5 {
            row.iter_mut().for_each(|x| *x /= norm);
            return;
        }
    }
}

/// `1 - beta v vᵀ`.
struct Reflector {
    v: Vec<f64>,
    beta: f64,
}

impl Reflector {
    /// That makes all entries but the first zero.
    fn of(row: &[f64]) -> Self {
        let mut v = row.to_vec();
        let norm = length(&v);
        let mut beta = 0.0;
        if norm > 0.0 {
            // Of unit length before its head is lengthened, so that no square vanishes.
            v.iter_mut().for_each(|x| *x /= norm);
            v[0] += 1_f64.copysign(v[0]);
            beta = 2.0 / dot(&v, &v);
        }
        Self { v, beta }
    }

    fn apply(&self, row: &mut [f64]) {
        let part = -self.beta * dot(&self.v, row);
        add_multiple(row, part, &self.v);
    }
}

/// How vectors became triangular.
struct Reduction {
    /// The j-th acts from entry j on.
    reflectors: Vec<Reflector>,
    /// Where each of the vectors was before.
    order: Vec<usize>,
}

/// Householder reduction of vectors (rows) to triangular form in place, of those that are left always the
/// longest first.
fn reduce(vectors: &mut Matrix) -> Reduction {
    let k = vectors.rows();
    let mut order: Vec<usize> = (0..k).collect();
    let mut reflectors = Vec::with_capacity(k);
    for j in 0..k {
        let mut longest = (j, 0.0);
        for i in j..k {
            let row = &vectors.row(i)[j..];
            let square = dot(row, row);
            if square > longest.1 {
                longest = (i, square);
            }
        }
        if longest.0 != j {
            let (row_j, row_longest) = vectors.two_rows_mut(j, longest.0);
            row_j.swap_with_slice(row_longest);
            order.swap(j, longest.0);
        }
        let reflector = Reflector::of(&vectors.row(j)[j..]);
        for i in j..k {
            reflector.apply(&mut vectors.row_mut(i)[j..]);
        }
        reflectors.push(reflector);
    }
    Reduction { reflectors, order }
}

/// Euclidean length, without overflow or underflow of a square.
fn length(v: &[f64]) -> f64 {
    let largest = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    let squares: f64 = v.iter().map(|x| (x / largest).powi(2)).sum();
    largest * squares.sqrt()
}

/// Turns two rows until they are orthogonal; `false` if they were.
fn orthogonalized(work: &mut Matrix, turned: &mut Matrix, p: usize, q: usize) -> bool {
    let (pp, qq) = (dot(work.row(p), work.row(p)), dot(work.row(q), work.row(q)));
    let pq = dot(work.row(p), work.row(q));
    // Rounding of a product of two rows; the root is that of LAPACK's dgesvj.
    let rounding = f64::EPSILON * (work.columns() as f64).sqrt().max(4.0);
    // Products below the least normal number are zero for all that the result can show.
    if pq.abs() <= rounding * pp.sqrt() * qq.sqrt() || pq.abs() < f64::MIN_POSITIVE {
        return false;
    }
    let Some((c, s)) = rotation(pp, qq, pq) else {
        return false;
    };
    for matrix in [work, turned] {
        let (row_p, row_q) = matrix.two_rows_mut(p, q);
        for (x, y) in row_p.iter_mut().zip(row_q) {
            (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
        }
    }
    true
}
