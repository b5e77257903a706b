//! A Gaussian as a square root of its information matrix, updated by reflections.
//!
//! `R` is upper triangular with a positive diagonal and `(Rᵀ R)⁻¹` is the covariance. It is symmetric and positive definite by construction,
//! because nothing is ever subtracted.
//!
//! Source: [Bierman 1977], chapters II and VI (Householder measurement update).

use super::reflections::{Fold, Folding};
use super::rows::Rows;
use super::tile::{
    AlignedTile, LANES, Tile, add_multiple, add_product, lane_sum, tile_dot, tiles, vectorize,
};
use pulp::{Arch, Simd, WithSimd};

/// Upper triangular square root of an information matrix.
#[derive(Debug)]
pub(crate) struct SquareRoot {
    pub(super) n: usize,
    pub(super) r: Vec<AlignedTile>,
}

impl Clone for SquareRoot {
    /// Keeps the capacity, so that overwriting the copy allocates no more than overwriting the original.
    fn clone(&self) -> Self {
        let mut r = Vec::with_capacity(self.r.capacity());
        r.extend_from_slice(&self.r);
        Self { n: self.n, r }
    }
}

impl SquareRoot {
    /// From the standard deviations of independent variables, which must be positive.
    pub(crate) fn from_deviations(deviations: &[f64]) -> Self {
        let n = deviations.len();
        let width = tiles(n);
        let mut r = vec![AlignedTile::ZERO; n * width];
        for (k, sd) in deviations.iter().enumerate() {
            r[k * width + k / LANES][k % LANES] = 1.0 / sd;
        }
        Self { n, r }
    }

    /// Makes the variables independent, with these diagonal entries.
    pub(crate) fn set_diagonal(&mut self, entry: impl Fn(usize) -> f64) {
        let width = tiles(self.n);
        self.r.fill(AlignedTile::ZERO);
        for k in 0..self.n {
            self.r[k * width + k / LANES][k % LANES] = entry(k);
        }
    }

    /// `|R x|²` of a padded vector: its squared Mahalanobis distance from zero.
    pub(crate) fn distance_squared(&self, x: &[Tile]) -> f64 {
        (0..self.n)
            .map(|k| {
                let first = k / LANES;
                tile_dot(&self.row(k)[first..], &x[first..]).powi(2)
            })
            .sum()
    }

    /// Do the diagonals agree to within a factor of `e^log_ratio`?
    pub(crate) fn differs_by_at_most(&self, other: &Self, log_ratio: f64) -> bool {
        let most = log_ratio.exp();
        (0..self.n).all(|k| {
            let (a, b) = (self.get(k, k), other.get(k, k));
            a <= most * b && b <= most * a
        })
    }

    /// Does not allocate if there is capacity for as many variables.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.n = other.n;
        self.r.clear();
        self.r.extend_from_slice(&other.r);
    }

    fn get(&self, row: usize, column: usize) -> f64 {
        self.row(row)[column / LANES][column % LANES]
    }

    #[inline(always)]
    fn row(&self, k: usize) -> &[AlignedTile] {
        let width = tiles(self.n);
        &self.r[k * width..(k + 1) * width]
    }

    /// The first two rows, mutable at once.
    pub(crate) fn top_two_mut(&mut self) -> (&mut [AlignedTile], &mut [AlignedTile]) {
        let width = tiles(self.n);
        self.r[..2 * width].split_at_mut(width)
    }

    /// Adds rows of evidence. `z` accumulates the right-hand side of `R δ = z`, where `δ` is the change of the mean since `z` was zero; `column` is
    /// scratch of twice the capacity of the rows.
    pub(crate) fn fold(&mut self, rows: &mut Rows, z: &mut [f64], column: &mut [f64]) -> Fold {
        Arch::new().dispatch(Folding {
            n: self.n,
            r: &mut self.r,
            rows,
            z,
            column,
        })
    }

    /// Solves `R x = z` in place; `padded` receives the solution in state columns.
    pub(crate) fn solve(&self, z: &mut [f64], padded: &mut [Tile]) {
        vectorize(Solving {
            root: self,
            z,
            padded,
        });
    }

    /// Solves `Rᵀ y = h` in place for every row `h`, all zero before entry `from`; the dot products of the results are the covariances of the rows.
    /// `column` is scratch of the capacity of the rows.
    pub(crate) fn solve_transposed(&self, rows: &mut Rows, from: usize, column: &mut [f64]) {
        vectorize(SolvingTransposed {
            root: self,
            rows,
            from,
            column,
        });
    }

    /// The covariance, row-major; for reports and tests.
    pub(crate) fn covariance(&self) -> Vec<f64> {
        let n = self.n;
        // Columns of R⁻ᵀ, so that P = (R⁻ᵀ)ᵀ R⁻ᵀ.
        let mut rows = Rows::new(n, n);
        rows.reset(n);
        for k in 0..n {
            rows.set(k, k, 1.0);
        }
        self.solve_transposed(&mut rows, 0, &mut vec![0.0; n]);
        let mut p = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let value = rows.dot(i, j, tiles(n));
                p[i * n + j] = value;
                p[j * n + i] = value;
            }
        }
        p
    }

    /// Lower bound of the condition number of the information matrix: the squared ratio of the
    /// largest to the smallest diagonal entry.
    pub(crate) fn condition(&self) -> f64 {
        let diagonal = (0..self.n).map(|k| self.get(k, k));
        let largest = diagonal.clone().fold(0.0, f64::max);
        let smallest = diagonal.fold(f64::INFINITY, f64::min);
        (largest / smallest).powi(2)
    }

    /// Number of variables.
    pub(crate) fn size(&self) -> usize {
        self.n
    }
}

/// The work of [`SquareRoot::solve`], also compiled for wide vectors.
struct Solving<'a> {
    root: &'a SquareRoot,
    z: &'a mut [f64],
    padded: &'a mut [Tile],
}

impl WithSimd for Solving<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { root, z, padded } = self;
        let (n, width) = (root.n, tiles(root.n));
        padded.fill([0.0; LANES]);
        for first in (0..width).rev() {
            // Contributions of the later tiles to all rows of this tile; they are independent of each other.
            let in_tile = first * LANES..n.min((first + 1) * LANES);
            let mut left: Tile = [0.0; LANES];
            let mut inverse: Tile = [0.0; LANES];
            for (l, k) in in_tile.clone().enumerate() {
                let row = &root.row(k)[first..];
                let mut sum: Tile = [0.0; LANES];
                for (r, x) in row[1..].iter().zip(&padded[first + 1..]) {
                    add_product::<S>(&mut sum, r, x);
                }
                left[l] = z[k] - lane_sum(&sum);
                inverse[l] = 1.0 / row[0][l];
            }
            for (l, k) in in_tile.clone().enumerate().rev() {
                let x = left[l] * inverse[l];
                padded[first][l] = x;
                z[k] = x;
                for (above, left) in in_tile.clone().zip(&mut left[..l]) {
                    *left -= root.row(above)[first][l] * x;
                }
            }
        }
    }
}

/// The work of [`SquareRoot::solve_transposed`], also compiled for wide vectors.
struct SolvingTransposed<'a> {
    root: &'a SquareRoot,
    rows: &'a mut Rows,
    from: usize,
    column: &'a mut [f64],
}

impl WithSimd for SolvingTransposed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            root,
            rows,
            from,
            column,
        } = self;
        let (m, capacity, width) = (rows.len, rows.capacity(), tiles(root.n));
        let y = &mut column[..m];
        for k in from..root.n {
            let (first, lane) = (k / LANES, k % LANES);
            let r = &root.row(k)[first..];
            let inverse = 1.0 / r[0][lane];
            let here = &rows.a[first * capacity..first * capacity + m];
            for (y, row) in y.iter_mut().zip(here) {
                *y = row[lane] * inverse;
            }
            // Before any evidence the coefficients are independent: nothing to subtract from the others.
            let mut beside = r.iter().flat_map(|tile| tile.0).skip(lane + 1);
            if beside.any(|x| x != 0.0) {
                for (t, r) in (first..width).zip(r) {
                    let block = &mut rows.a[t * capacity..t * capacity + m];
                    for (row, y) in block.iter_mut().zip(y.iter()) {
                        add_multiple::<S>(row, -y, r);
                    }
                }
            }
            let here = &mut rows.a[first * capacity..first * capacity + m];
            for (row, y) in here.iter_mut().zip(y.iter()) {
                row[lane] = *y;
            }
        }
    }
}
