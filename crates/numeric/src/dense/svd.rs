//! Singular values.

use super::eigen::rotation;
use super::matrix::add_multiple;
use super::{Matrix, dot};
use std::fmt;

/// Singular values were not found: the matrix has NaN or infinity, or a singular value overflows.
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
    /// Singular values, not negative, largest first.
    pub singular: Vec<f64>,
    /// `columns × k`; columns are orthonormal.
    pub right: Matrix,
}

/// Maximum number of sweeps. Convergence is quadratic; no tested matrix needed more than ten.
const SWEEPS: usize = 60;

/// Scale of the largest entry while rotating (2^480): its square is far from overflow, and small entries are far
/// from underflow.
const LARGEST: f64 = f64::from_bits((1023 + 480) << 52);

/// Rows shorter than this count as zero, because such small numbers have few digits left.
const ZERO: f64 = 1e-290;

/// A row shorter than this relative to another does not change it.
const NEGLIGIBLE: f64 = 1e-100;

/// Squared lengths below this have lost digits.
const SMALL_SQUARE: f64 = 1e-280;

impl Svd {
    /// By one-sided Jacobi rotations of the triangular factor of a pivoted reduction.
    ///
    /// Error: relative error of each singular value about `n ε` for a matrix that is well conditioned except
    /// for column scaling, `n ε ‖A‖` in general. Source: [Demmel 1992], algorithm 4.1, on the transposed
    /// factor of a Householder reduction with column pivoting as in [Drmač 2008].
    ///
    /// Singular values below 1e-430 of the largest entry are returned as 0.
    ///
    /// # Errors
    /// NaN or infinity, or entries so large that a singular value is infinite.
    pub fn thin(a: &Matrix) -> Result<Self, NotConverged> {
        let failed = NotConverged {
            rows: a.rows(),
            columns: a.columns(),
        };
        if a.entries().iter().any(|x| !x.is_finite()) {
            return Err(failed);
        }
        let largest = a.entries().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Multiply in an order without overflow or loss of digits.
        let scaled = |x: f64| match largest {
            0.0 => x,
            1.0.. => x / (largest / LARGEST),
            _ => x * LARGEST / largest,
        };
        let unscaled = |x: f64| match largest {
            1.0.. => x * (largest / LARGEST),
            _ => x * largest / LARGEST,
        };
        let tall = a.rows() >= a.columns();
        let vectors = if tall {
            Matrix::from_fn(a.columns(), a.rows(), |i, j| scaled(a[(j, i)]))
        } else {
            Matrix::from_fn(a.rows(), a.columns(), |i, j| scaled(a[(i, j)]))
        };
        let (long, singular, short) = decomposed(vectors).ok_or(failed)?;
        let (left, right) = if tall { (long, short) } else { (short, long) };
        let singular: Vec<f64> = singular.into_iter().map(unscaled).collect();
        if singular.iter().any(|s| !s.is_finite()) {
            return Err(failed);
        }
        Ok(Self {
            left: left.transpose(),
            singular,
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

/// For `k` vectors (rows) of length `m >= k`: singular vectors of the long side (`k × m`), singular values, singular
/// vectors of the short side (`k × k`), one per row.
fn decomposed(mut vectors: Matrix) -> Option<(Matrix, Vec<f64>, Matrix)> {
    let (k, m) = (vectors.rows(), vectors.columns());
    let Reduction { reflectors, order } = reduce(&mut vectors);
    // The remaining matrix is triangular, with its largest rows first, so rotations of its rows converge in few sweeps.
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
    let lengths: Vec<f64> = (0..k)
        .map(|i| length(work.row(i)))
        .map(|length| if length < ZERO { 0.0 } else { length })
        .collect();
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
        // Twice: the first pass loses digits if the unit vector nearly lies in their span.
        for other in before
            .chunks_exact(columns)
            .chain(before.chunks_exact(columns))
        {
            add_multiple(row, -dot(other, row), other);
        }
        let norm = length(row);
        // At least one unit vector keeps this length.
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
    /// The reflector that makes all entries except the first zero.
    fn of(row: &[f64]) -> Self {
        let mut v = row.to_vec();
        let norm = length(&v);
        let mut beta = 0.0;
        if norm > 0.0 {
            // Normalise before changing the first entry, so that no square underflows.
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

/// Reduction of vectors to triangular form.
struct Reduction {
    /// The j-th acts on entries from j on.
    reflectors: Vec<Reflector>,
    /// Original index of each vector.
    order: Vec<usize>,
}

/// Householder reduction of vectors (rows) to triangular form in place; each step takes the longest remaining vector.
fn reduce(vectors: &mut Matrix) -> Reduction {
    let k = vectors.rows();
    let mut order: Vec<usize> = (0..k).collect();
    let mut reflectors = Vec::with_capacity(k);
    for j in 0..k {
        let longest_by = |size: fn(&[f64]) -> f64| {
            (j..k).fold((j, 0.0), |longest: (usize, f64), i| {
                let size = size(&vectors.row(i)[j..]);
                if size > longest.1 { (i, size) } else { longest }
            })
        };
        let mut longest = longest_by(|row| dot(row, row));
        if longest.1 < SMALL_SQUARE {
            longest = longest_by(length);
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

/// Removes the component along a far longer row: the rotation that does so leaves the longer row unchanged.
fn without(row: &mut [f64], part: f64, along: &[f64], length: f64) {
    for (x, along) in row.iter_mut().zip(along) {
        *x -= part * (along / length);
    }
}

/// Rotates two rows until they are orthogonal; `false` if they already were.
fn orthogonalized(work: &mut Matrix, turned: &mut Matrix, p: usize, q: usize) -> bool {
    let (pp, qq) = (dot(work.row(p), work.row(p)), dot(work.row(q), work.row(q)));
    // Rounding of a product of two rows; the square root is as in LAPACK's dgesvj.
    let rounding = f64::EPSILON * (work.columns() as f64).sqrt().max(4.0);
    let angle = if pp.min(qq) < SMALL_SQUARE {
        let (row_p, row_q) = work.two_rows_mut(p, q);
        let (length_p, length_q) = (length(row_p), length(row_q));
        if length_p.min(length_q) < ZERO {
            return false;
        }
        let products = row_p.iter().zip(&*row_q);
        let cosine: f64 = products.map(|(x, y)| x / length_p * (y / length_q)).sum();
        if cosine.abs() <= rounding {
            return false;
        }
        if length_q < NEGLIGIBLE * length_p {
            without(row_q, cosine * length_q, row_p, length_p);
            return true;
        }
        if length_p < NEGLIGIBLE * length_q {
            without(row_p, cosine * length_p, row_q, length_q);
            return true;
        }
        let ratio = length_q / length_p;
        rotation(1.0, ratio * ratio, cosine * ratio)
    } else {
        let pq = dot(work.row(p), work.row(q));
        if pq.abs() <= rounding * pp.sqrt() * qq.sqrt() {
            return false;
        }
        rotation(pp, qq, pq)
    };
    let Some((c, s)) = angle else {
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
