//! Folds rows of evidence into a square root by Householder reflections, two columns at a time.

use super::rows::Rows;
use super::tile::{AlignedTile, LANES, Tile, add_multiple, tiles};
use hwall_numeric::dense::dot;
use pulp::{Simd, WithSimd};

/// Number of independent sums.
const CHAINS: usize = 4;

/// Statistics of rows that were folded into a Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fold {
    /// Squared Mahalanobis distance of the rows from their prediction.
    pub(crate) distance_squared: f64,
    /// `ln det(1 + A P Aᵀ)`.
    pub(crate) log_determinant: f64,
}

/// The work of [`SquareRoot::fold`](super::SquareRoot::fold), compiled once for any machine and once for wide vectors; the choice is made at run
/// time. On machines with fused multiply-add the last digits differ.
pub(super) struct Folding<'a> {
    /// Number of variables.
    pub(super) n: usize,
    /// The square root, row by row.
    pub(super) r: &'a mut [AlignedTile],
    pub(super) rows: &'a mut Rows,
    pub(super) z: &'a mut [f64],
    pub(super) column: &'a mut [f64],
}

impl WithSimd for Folding<'_> {
    type Output = Fold;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Fold {
        let Self {
            n,
            r,
            rows,
            z,
            column,
        } = self;
        let width = tiles(n);
        let (m, capacity) = (rows.len, rows.capacity());
        let (v, u) = column.split_at_mut(capacity);
        let (v, u) = (&mut v[..m], &mut u[..m]);
        let mut growth = Growth::default();
        // Two columns of a tile at a time: halves the memory traffic to the right of it. An odd last column has nothing to its right.
        for (pair, z) in z[..n].chunks_mut(2).enumerate() {
            let k = 2 * pair;
            let first = k / LANES;
            let (here, right) = rows.a[first * capacity..].split_at_mut(capacity);
            let here = &mut here[..m];
            let (r, below) = r[k * width + first..].split_at_mut(1);
            let one = reflect_first(simd, k, &mut r[0], here, v);
            growth.count(&one);
            one.reflect_scalars(v, &mut z[0], &mut rows.e[..m]);
            let Some(z) = z.get_mut(1) else { break };
            let (rest, s) = below.split_at_mut(width - 1);
            let (s, last) = s.split_at_mut(1);
            let two = reflect_first(simd, k + 1, &mut s[0], here, u);
            growth.count(&two);
            two.reflect_scalars(u, z, &mut rows.e[..m]);
            let across = dot(v, u);
            let columns = Pair {
                one,
                two,
                across,
                v,
                u,
            };
            for ((r, s), block) in rest[..width - 1 - first]
                .iter_mut()
                .zip(last)
                .zip(right.chunks_mut(capacity.max(1)))
            {
                columns.reflect(simd, r, s, &mut block[..m]);
            }
        }
        Fold {
            distance_squared: dot(&rows.e[..m], &rows.e[..m]),
            log_determinant: growth.log_determinant(),
        }
    }
}

/// `1 - beta [v0; v] [v0; v]ᵀ`: zeroes a column of evidence rows. Identity if `beta` is zero.
#[derive(Clone, Copy)]
struct Reflector {
    v0: f64,
    beta: f64,
    /// Growth of the diagonal entry.
    factor: f64,
}

impl Reflector {
    /// The reflection that maps a column with `d` on the diagonal and the sum of squares `below` under it to `norm` and zeros.
    #[inline(always)]
    fn new(d: f64, below: f64) -> (Self, f64) {
        // Far below the rounding of the diagonal: nothing to reflect. Non-finite values pass on and are detected in the results.
        if below <= d * d * 1e-40 {
            let none = Self {
                v0: 0.0,
                beta: 0.0,
                factor: 1.0,
            };
            return (none, d);
        }
        let norm = (d * d + below).sqrt();
        let reflector = Self {
            // d - norm without cancellation; this sign keeps the diagonal positive.
            v0: -below / (d + norm),
            // 2 / (v0² + below), from independent quotients.
            beta: (1.0 / norm) * ((d + norm) / below),
            factor: norm / d,
        };
        (reflector, norm)
    }

    /// Reflects the right-hand sides.
    #[inline(always)]
    fn reflect_scalars(&self, v: &[f64], z: &mut f64, e: &mut [f64]) {
        let w = self.beta * (self.v0 * *z + dot(v, e));
        *z -= self.v0 * w;
        for (v, e) in v.iter().zip(e) {
            *e -= v * w;
        }
    }
}

/// The running product of all factors of the diagonal.
struct Growth {
    logarithm: f64,
    product: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Self {
            logarithm: 0.0,
            product: 1.0,
        }
    }
}

impl Growth {
    #[inline(always)]
    fn count(&mut self, reflector: &Reflector) {
        self.product *= reflector.factor;
        if self.product > 1e100 {
            self.logarithm += self.product.ln();
            self.product = 1.0;
        }
    }

    fn log_determinant(&self) -> f64 {
        2.0 * (self.logarithm + self.product.ln())
    }
}

/// Finds the reflection that clears column `k` below the diagonal, and applies it to the tile of that column: the diagonal row `r` and the evidence
/// rows below it. Stores the column in `v`.
#[inline(always)]
fn reflect_first<S: Simd>(
    simd: S,
    k: usize,
    r: &mut Tile,
    block: &mut [AlignedTile],
    v: &mut [f64],
) -> Reflector {
    let lane = k % LANES;
    // Computes all products with the column, including its own square, before anything waits for a square root.
    let products = column_products(simd, lane, block);
    for (v, row) in v.iter_mut().zip(block.iter()) {
        *v = row[lane];
    }
    let (reflector, norm) = Reflector::new(r[lane], products[lane]);
    let Reflector { v0, beta, .. } = reflector;
    let mut w = [0.0; LANES];
    for l in 0..LANES {
        w[l] = -beta * (v0 * r[l] + products[l]);
    }
    add_multiple::<S>(r, v0, &w);
    add_to_rows(simd, block, v, &w);
    for (l, r) in r.iter_mut().enumerate() {
        *r = if l < lane { 0.0 } else { *r };
    }
    r[lane] = norm;
    reflector
}

/// Sum of the rows, each multiplied by its entry in `lane`. Uses several independent chains of additions.
///
/// If a tile fits a vector, uses explicit vectors: otherwise the compiler takes one column of many rows at a time, with gathers and scatters.
#[inline(always)]
fn column_products<S: Simd>(simd: S, lane: usize, block: &[AlignedTile]) -> Tile {
    let lane = lane % LANES;
    let (fours, last) = block.as_chunks::<CHAINS>();
    if S::F64_LANES == LANES {
        let load = |tile: &Tile| S::as_simd_f64s(tile).0[0];
        let mut sums = [simd.splat_f64s(0.0); CHAINS];
        for rows in fours {
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = simd.mul_add_e_f64s(simd.splat_f64s(row[lane]), load(row), *sum);
            }
        }
        for (sum, row) in sums.iter_mut().zip(last) {
            *sum = simd.mul_add_e_f64s(simd.splat_f64s(row[lane]), load(row), *sum);
        }
        let [a, b, c, d] = sums;
        let mut products = [0.0; LANES];
        S::as_mut_simd_f64s(&mut products).0[0] =
            simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
        return products;
    }
    let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
    let (pairs, last) = block.as_chunks::<2>();
    for rows in pairs {
        add_multiple::<S>(&mut even, rows[0][lane], &rows[0]);
        add_multiple::<S>(&mut odd, rows[1][lane], &rows[1]);
    }
    for row in last {
        add_multiple::<S>(&mut even, row[lane], row);
    }
    std::array::from_fn(|l| even[l] + odd[l])
}

/// Adds multiples of one row to all rows.
#[inline(always)]
fn add_to_rows<S: Simd>(simd: S, block: &mut [AlignedTile], v: &[f64], w: &Tile) {
    if S::F64_LANES == LANES {
        let w = S::as_simd_f64s(w).0[0];
        for (v, row) in v.iter().zip(block.iter_mut()) {
            let row = &mut S::as_mut_simd_f64s(&mut row.0).0[0];
            *row = simd.mul_add_e_f64s(simd.splat_f64s(*v), w, *row);
        }
        return;
    }
    for (v, row) in v.iter().zip(block.iter_mut()) {
        add_multiple::<S>(row, *v, w);
    }
}

/// The reflections of two neighbouring columns, applied one after the other.
struct Pair<'a> {
    one: Reflector,
    two: Reflector,
    /// `v · u`.
    across: f64,
    v: &'a [f64],
    u: &'a [f64],
}

impl Pair<'_> {
    /// Applies both reflections to `LANES` columns: the diagonal rows `r` and `s`, and the evidence rows.
    #[inline(always)]
    fn reflect<S: Simd>(&self, simd: S, r: &mut Tile, s: &mut Tile, block: &mut [AlignedTile]) {
        if S::F64_LANES == LANES {
            self.reflect_at_once(simd, r, s, block);
            return;
        }
        let Self {
            one,
            two,
            across,
            v,
            u,
        } = *self;
        let (mut by_v, mut by_u) = ([0.0; LANES], [0.0; LANES]);
        for ((v, u), row) in v.iter().zip(u).zip(block.iter()) {
            add_multiple::<S>(&mut by_v, *v, row);
            add_multiple::<S>(&mut by_u, *u, row);
        }
        let (mut w, mut x) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            w[l] = -one.beta * (one.v0 * r[l] + by_v[l]);
            x[l] = -two.beta * (two.v0 * s[l] + (by_u[l] + across * w[l]));
        }
        add_multiple::<S>(r, one.v0, &w);
        add_multiple::<S>(s, two.v0, &x);
        for ((v, u), row) in v.iter().zip(u).zip(block.iter_mut()) {
            add_multiple::<S>(row, *v, &w);
            add_multiple::<S>(row, *u, &x);
        }
    }

    /// As [`reflect`](Self::reflect), with explicit vectors, if a tile fits a vector.
    #[inline(always)]
    fn reflect_at_once<S: Simd>(
        &self,
        simd: S,
        r: &mut Tile,
        s: &mut Tile,
        block: &mut [AlignedTile],
    ) {
        let Self {
            one,
            two,
            across,
            v,
            u,
        } = *self;
        let load = |tile: &Tile| S::as_simd_f64s(tile).0[0];
        let splat = |x: f64| simd.splat_f64s(x);
        let mut by_v = [splat(0.0); 2];
        let mut by_u = [splat(0.0); 2];
        let (v_pairs, v_last) = v.as_chunks::<2>();
        let (u_pairs, u_last) = u.as_chunks::<2>();
        let (row_pairs, row_last) = block.as_chunks::<2>();
        for ((v, u), rows) in v_pairs.iter().zip(u_pairs).zip(row_pairs) {
            for i in 0..2 {
                let row = load(&rows[i]);
                by_v[i] = simd.mul_add_e_f64s(splat(v[i]), row, by_v[i]);
                by_u[i] = simd.mul_add_e_f64s(splat(u[i]), row, by_u[i]);
            }
        }
        for ((v, u), row) in v_last.iter().zip(u_last).zip(row_last) {
            let row = load(row);
            by_v[0] = simd.mul_add_e_f64s(splat(*v), row, by_v[0]);
            by_u[0] = simd.mul_add_e_f64s(splat(*u), row, by_u[0]);
        }
        let by_v = simd.add_f64s(by_v[0], by_v[1]);
        let by_u = simd.add_f64s(by_u[0], by_u[1]);
        let (top, second) = (load(r), load(s));
        let (one_v0, two_v0) = (splat(one.v0), splat(two.v0));
        let w = simd.mul_f64s(splat(-one.beta), simd.mul_add_e_f64s(one_v0, top, by_v));
        let by_u = simd.mul_add_e_f64s(splat(across), w, by_u);
        let x = simd.mul_f64s(splat(-two.beta), simd.mul_add_e_f64s(two_v0, second, by_u));
        S::as_mut_simd_f64s(r).0[0] = simd.mul_add_e_f64s(one_v0, w, top);
        S::as_mut_simd_f64s(s).0[0] = simd.mul_add_e_f64s(two_v0, x, second);
        for ((v, u), row) in v.iter().zip(u).zip(block.iter_mut()) {
            let row = &mut S::as_mut_simd_f64s(&mut row.0).0[0];
            let once = simd.mul_add_e_f64s(splat(*v), w, *row);
            *row = simd.mul_add_e_f64s(splat(*u), x, once);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::square_root::SquareRoot;
    use super::*;
    use hwall_testkit::Sampler;
    use pulp::Arch;

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

    /// The whole square root, the fold, and the change of the mean.
    fn folded(rows: &Rows, with: impl FnOnce(Folding<'_>) -> Fold) -> (Vec<f64>, Fold, Vec<f64>) {
        let deviations: Vec<f64> = (0..N).map(|k| 10_f64.powi(k as i32 % 5 - 2)).collect();
        let mut root = SquareRoot::from_deviations(&deviations);
        let (mut rows, mut z) = (rows.clone(), vec![0.0; N]);
        let mut column = vec![0.0; 2 * rows.len];
        let fold = with(Folding {
            n: root.n,
            r: &mut root.r,
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

    /// All machine types agree, and the entries below the diagonal stay zero.
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
