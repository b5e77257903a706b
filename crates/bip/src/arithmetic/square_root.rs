//! A Gaussian as a square root of its information matrix, updated by reflections.
//!
//! `R` is upper triangular with a positive diagonal and `(Rᵀ R)⁻¹` is the covariance: symmetric
//! and positive definite whatever happens, because nothing is ever subtracted from it.
//!
//! Source: [Bierman 1977], chapters II and VI (Householder measurement update).

use super::rows::Rows;
use super::tile::{
    AlignedTile, LANES, Tile, add_multiple, lane_sum, sum_of_squares, tile_dot, tiles, vectorize,
};
use pulp::{Arch, Simd, WithSimd};

/// Sums that are added up side by side.
const CHAINS: usize = 4;

/// What folding rows into a Gaussian says about them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fold {
    /// Squared Mahalanobis distance of the rows from their prediction.
    pub(crate) distance_squared: f64,
    /// `ln det(1 + A P Aᵀ)`.
    pub(crate) log_determinant: f64,
}

/// Upper triangular square root of an information matrix.
#[derive(Debug, Clone)]
pub(crate) struct SquareRoot {
    n: usize,
    r: Vec<AlignedTile>,
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

    /// `|R x|²` of a padded vector: its squared distance from zero in standard deviations.
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

    /// Does not allocate where there was room for as many variables before.
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

    /// Adds rows of evidence. `z` gathers the right-hand side of `R δ = z` for the change of the mean
    /// since `z` was zero; `column` is scratch of the capacity of the rows.
    pub(crate) fn fold(&mut self, rows: &mut Rows, z: &mut [f64], column: &mut [f64]) -> Fold {
        Arch::new().dispatch(Folding {
            root: self,
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

    /// Solves `Rᵀ y = h` in place for every row `h`, all of them zero before entry `from`; the
    /// dot products of what is left are the covariances of the rows. `column` is scratch of the
    /// capacity of the rows.
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

/// The work of [`SquareRoot::fold`], compiled once for any machine and once for wide vectors, chosen
/// at run time. Machines with fused multiplication and addition round the last digits differently.
struct Folding<'a> {
    root: &'a mut SquareRoot,
    rows: &'a mut Rows,
    z: &'a mut [f64],
    column: &'a mut [f64],
}

impl WithSimd for Folding<'_> {
    type Output = Fold;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Fold {
        let Self {
            root,
            rows,
            z,
            column,
        } = self;
        let width = tiles(root.n);
        let (m, capacity) = (rows.len, rows.capacity());
        let v = &mut column[..m];
        let mut log_determinant = 0.0;
        let mut product = 1.0;
        for (k, z) in z.iter_mut().enumerate().take(root.n) {
            let (first, lane) = (k / LANES, k % LANES);
            let here = &mut rows.a[first * capacity..first * capacity + m];
            for (v, row) in v.iter_mut().zip(here.iter()) {
                *v = row[lane];
            }
            let below = sum_of_squares(v);
            let r = &mut root.r[k * width..(k + 1) * width];
            let d = r[first][lane];
            // Weaker than the rounding of the diagonal by twenty orders: nothing to reflect.
            if below > d * d * 1e-40 {
                let norm = (d * d + below).sqrt();
                // d - norm without cancellation; this sign keeps the diagonal positive.
                let v0 = -below / (d + norm);
                // 2 / (v0² + below), from quotients that do not wait for each other.
                let beta = (1.0 / norm) * ((d + norm) / below);
                for (t, r) in r.iter_mut().enumerate().skip(first) {
                    let block = &mut rows.a[t * capacity..t * capacity + m];
                    reflect(simd, r, block, v0, v, beta);
                }
                let mut w = v0 * *z;
                for (v, e) in v.iter().zip(&rows.e) {
                    w += v * e;
                }
                w *= beta;
                *z -= v0 * w;
                for (v, e) in v.iter().zip(&mut rows.e) {
                    *e -= v * w;
                }
                for (l, r) in r[first].iter_mut().enumerate() {
                    *r = if l < lane { 0.0 } else { *r };
                }
                r[first][lane] = norm;
                product *= norm / d;
                if product > 1e100 {
                    log_determinant += product.ln();
                    product = 1.0;
                }
            }
        }
        Fold {
            distance_squared: sum_of_squares(&rows.e[..m]),
            log_determinant: 2.0 * (log_determinant + product.ln()),
        }
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
        self.padded.fill([0.0; LANES]);
        for k in (0..self.root.n).rev() {
            let first = k / LANES;
            let row = &self.root.row(k)[first..];
            // Ready before the sum is, of which the newest part comes last.
            let inverse = 1.0 / row[0][k % LANES];
            let mut sum: Tile = [0.0; LANES];
            for (r, x) in row.iter().zip(&self.padded[first..]).rev() {
                for ((s, r), x) in sum.iter_mut().zip(&r.0).zip(x) {
                    *s += r * x;
                }
            }
            self.z[k] = (self.z[k] - lane_sum(&sum)) * inverse;
            self.padded[first][k % LANES] = self.z[k];
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
            for (t, r) in (first..width).zip(r) {
                let block = &mut rows.a[t * capacity..t * capacity + m];
                for (row, y) in block.iter_mut().zip(y.iter()) {
                    add_multiple::<S>(row, -y, r);
                }
            }
            let here = &mut rows.a[first * capacity..first * capacity + m];
            for (row, y) in here.iter_mut().zip(y.iter()) {
                row[lane] = *y;
            }
        }
    }
}

/// One reflection on `LANES` columns: the diagonal row `r` and the evidence rows below it.
///
/// `r` comes last in the sums, because `v0` takes a root and a quotient. Several chains of additions, because each waits
/// for the one before it.
#[inline(always)]
fn reflect<S: Simd>(
    simd: S,
    r: &mut Tile,
    block: &mut [AlignedTile],
    v0: f64,
    v: &[f64],
    beta: f64,
) {
    if S::F64_LANES == LANES {
        reflect_at_once(simd, r, block, v0, v, beta);
        return;
    }
    let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
    let (v_pairs, v_last) = v.as_chunks::<2>();
    let (row_pairs, row_last) = block.as_chunks::<2>();
    for (v, rows) in v_pairs.iter().zip(row_pairs) {
        add_multiple::<S>(&mut even, v[0], &rows[0]);
        add_multiple::<S>(&mut odd, v[1], &rows[1]);
    }
    for (v, row) in v_last.iter().zip(row_last) {
        add_multiple::<S>(&mut even, *v, row);
    }
    let mut w = [0.0; LANES];
    for l in 0..LANES {
        w[l] = -beta * (v0 * r[l] + (even[l] + odd[l]));
    }
    add_multiple::<S>(r, v0, &w);
    for (v, row) in v.iter().zip(block.iter_mut()) {
        add_multiple::<S>(row, *v, &w);
    }
}

/// The same where a vector holds a tile, by name: left to itself the compiler takes one column of many rows at a time
/// there, which gathers and scatters.
#[inline(always)]
fn reflect_at_once<S: Simd>(
    simd: S,
    r: &mut Tile,
    block: &mut [AlignedTile],
    v0: f64,
    v: &[f64],
    beta: f64,
) {
    let load = |tile: &Tile| S::as_simd_f64s(tile).0[0];
    let splat = |x: f64| simd.splat_f64s(x);
    let mut sums = [splat(0.0); CHAINS];
    let (v_fours, v_last) = v.as_chunks::<CHAINS>();
    let (row_fours, row_last) = block.as_chunks::<CHAINS>();
    for (v, rows) in v_fours.iter().zip(row_fours) {
        for ((sum, v), row) in sums.iter_mut().zip(v).zip(rows) {
            *sum = simd.mul_add_e_f64s(splat(*v), load(row), *sum);
        }
    }
    for ((sum, v), row) in sums.iter_mut().zip(v_last).zip(row_last) {
        *sum = simd.mul_add_e_f64s(splat(*v), load(row), *sum);
    }
    let [a, b, c, d] = sums;
    let sum = simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
    let (v0, old) = (splat(v0), load(r));
    let w = simd.mul_f64s(splat(-beta), simd.mul_add_e_f64s(v0, old, sum));
    S::as_mut_simd_f64s(r).0[0] = simd.mul_add_e_f64s(v0, w, old);
    for (v, row) in v.iter().zip(block.iter_mut()) {
        let new = simd.mul_add_e_f64s(splat(*v), w, load(row));
        S::as_mut_simd_f64s(&mut row.0).0[0] = new;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    const N: usize = 21;

    fn evidence(sampler: &mut Sampler, m: usize) -> Rows {
        let mut rows = Rows::new(N, m);
        rows.reset(m);
        for i in 0..m {
            for k in 0..N {
                rows.set(i, k, sampler.normal());
            }
            rows.e[i] = sampler.normal();
        }
        rows
    }

    /// The whole square root, what was folded, and the change of the mean.
    fn folded(rows: &Rows, with: impl FnOnce(Folding<'_>) -> Fold) -> (Vec<f64>, Fold, Vec<f64>) {
        let deviations: Vec<f64> = (0..N).map(|k| 10_f64.powi(k as i32 % 5 - 2)).collect();
        let mut root = SquareRoot::from_deviations(&deviations);
        let (mut rows, mut z) = (rows.clone(), vec![0.0; N]);
        let mut column = vec![0.0; rows.len];
        let fold = with(Folding {
            root: &mut root,
            rows: &mut rows,
            z: &mut z,
            column: &mut column,
        });
        root.solve(&mut z, &mut vec![[0.0; LANES]; tiles(N)]);
        let all = root.r.iter().flat_map(|tile| tile.0).collect();
        (all, fold, z)
    }

    fn assert_alike(a: &(Vec<f64>, Fold, Vec<f64>), b: &(Vec<f64>, Fold, Vec<f64>)) {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + a.abs().max(b.abs()));
        assert!(a.0.iter().zip(&b.0).all(|(a, b)| close(*a, *b)));
        assert!(a.2.iter().zip(&b.2).all(|(a, b)| close(*a, *b)));
        assert!(close(a.1.distance_squared, b.1.distance_squared));
        assert!(close(a.1.log_determinant, b.1.log_determinant));
    }

    /// Every kind of machine, and what is below the diagonal stays zero.
    #[test]
    fn narrow_and_wide_vectors_fold_alike() {
        let mut sampler = Sampler::new(12);
        for m in [1, 2, 3, 4, 7, 18, 25] {
            let rows = evidence(&mut sampler, m);
            let any = folded(&rows, |folding| Arch::new().dispatch(folding));
            let scalar = folded(&rows, |folding| folding.with_simd(pulp::Scalar::new()));
            assert_alike(&any, &scalar);
            #[cfg(target_arch = "x86_64")]
            if let Some(simd) = pulp::x86::V3::try_new() {
                assert_alike(
                    &any,
                    &folded(&rows, |folding| Simd::vectorize(simd, folding)),
                );
            }
            let stride = tiles(N) * LANES;
            for k in 0..N {
                let row = &any.0[k * stride..][..stride];
                assert!(row[..k].iter().all(|x| *x == 0.0) && row[k] > 0.0);
                assert!(row[N..].iter().all(|x| *x == 0.0));
            }
        }
    }
}
