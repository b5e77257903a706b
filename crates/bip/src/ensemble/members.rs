//! The members of an ensemble side by side: one row a variable, eight members to a vector.

use crate::Model;
use crate::projector::PHASE_STATES;
use crate::square_root::{LANES, Tile, add_multiple, lane_sum, tiles};
use faer::traits::pulp::{Arch, Simd, WithSimd};

/// A table with one row a variable and one column a member. Columns are padded to whole tiles;
/// what the padding holds matters to nothing but [`Table::product`], which wants zeros there.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    members: usize,
    width: usize,
    entries: Vec<Tile>,
}

impl Table {
    /// All zero.
    pub(crate) fn new(rows: usize, members: usize) -> Self {
        let width = tiles(members);
        Self {
            members,
            width,
            entries: vec![[0.0; LANES]; rows * width],
        }
    }

    pub(crate) fn members(&self) -> usize {
        self.members
    }

    fn tiles(&self, row: usize) -> &[Tile] {
        &self.entries[row * self.width..(row + 1) * self.width]
    }

    fn tiles_mut(&mut self, row: usize) -> &mut [Tile] {
        &mut self.entries[row * self.width..(row + 1) * self.width]
    }

    /// One variable of all members, without the padding.
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.tiles(row).as_flattened()[..self.members]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        let members = self.members;
        &mut self.tiles_mut(row).as_flattened_mut()[..members]
    }

    /// The first two rows.
    pub(crate) fn top_two_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        let (first, rest) = self.entries.split_at_mut(self.width);
        let second = &mut rest[..self.width];
        (
            &mut first.as_flattened_mut()[..self.members],
            &mut second.as_flattened_mut()[..self.members],
        )
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.entries.copy_from_slice(&other.entries);
    }

    /// Copies the first rows.
    pub(crate) fn copy_rows_from(&mut self, other: &Self, rows: usize) {
        let count = rows * self.width;
        self.entries[..count].copy_from_slice(&other.entries[..count]);
    }

    /// Are the first rows finite?
    pub(crate) fn is_finite(&self, rows: usize) -> bool {
        // 0 x is zero or NaN, so the sum tells without a branch an entry.
        (0..rows).all(|k| self.row(k).iter().map(|x| 0.0 * x).sum::<f64>() == 0.0)
    }

    pub(crate) fn mean(&self, row: usize) -> f64 {
        let row = self.row(row);
        row.iter().sum::<f64>() / row.len() as f64
    }

    /// Sample covariance of two rows, with `members - 1`.
    pub(crate) fn covariance(&self, i: usize, j: usize) -> f64 {
        let (mean_i, mean_j) = (self.mean(i), self.mean(j));
        let rows = self.row(i).iter().zip(self.row(j));
        rows.map(|(a, b)| (a - mean_i) * (b - mean_j)).sum::<f64>() / (self.members - 1) as f64
    }

    /// Subtracts the mean of a row and clears its padding; returns the mean.
    pub(crate) fn centre(&mut self, row: usize) -> f64 {
        let mean = self.mean(row);
        let members = self.members;
        let all = self.tiles_mut(row).as_flattened_mut();
        all[..members].iter_mut().for_each(|x| *x -= mean);
        all[members..].fill(0.0);
        mean
    }

    pub(crate) fn scale(&mut self, row: usize, factor: f64) {
        self.tiles_mut(row)
            .as_flattened_mut()
            .iter_mut()
            .for_each(|x| *x *= factor);
    }

    /// `row[to] += factor · row[from]`; the two differ.
    fn add_row(&mut self, to: usize, factor: f64, from: usize) {
        let width = self.width;
        let (low, high) = self.entries.split_at_mut(to.max(from) * width);
        let (low, high) = (
            &mut low[to.min(from) * width..][..width],
            &mut high[..width],
        );
        let (to, from) = if to < from { (low, high) } else { (high, low) };
        Arch::new().dispatch(AddMultiple { to, factor, from });
    }

    /// `row[to] += Σ_i factors[i] · other.row[i]`.
    pub(crate) fn add_combination(&mut self, to: usize, factors: &[f64], other: &Self) {
        for (i, factor) in factors.iter().enumerate() {
            Arch::new().dispatch(AddMultiple {
                to: self.tiles_mut(to),
                factor: *factor,
                from: other.tiles(i),
            });
        }
    }

    /// Sum over the members of the products of a row of this table and one of another.
    pub(crate) fn product(&self, row: usize, other: &Self, other_row: usize) -> f64 {
        Arch::new().dispatch(Dot {
            a: self.tiles(row),
            b: other.tiles(other_row),
        })
    }

    /// Divides the first `m` rows by a lower triangular `m × m` matrix from the left, to whose
    /// diagonal `shift` is added.
    pub(crate) fn divide_lower(&mut self, m: usize, lower: &[f64], shift: f64) {
        for i in 0..m {
            for j in 0..i {
                self.add_row(i, -lower[i * m + j], j);
            }
            self.scale(i, 1.0 / (lower[i * m + i] + shift));
        }
    }

    /// Divides the first `m` rows by the transpose of a lower triangular matrix from the left.
    pub(crate) fn divide_transposed(&mut self, m: usize, lower: &[f64]) {
        for i in (0..m).rev() {
            for j in i + 1..m {
                self.add_row(i, -lower[j * m + i], j);
            }
            self.scale(i, 1.0 / lower[i * m + i]);
        }
    }
}

/// What every member expects to be observed, with the scratch that computing it needs.
#[derive(Debug, Clone)]
pub(crate) struct Predictor {
    model: Model,
    /// Per group: its functions at the phases of eight members.
    functions: Vec<Vec<Tile>>,
    needed: Vec<bool>,
    /// Coefficients of eight members.
    coefficients: Vec<Tile>,
    values: Vec<f64>,
    slopes: Vec<f64>,
    raw: Vec<f64>,
}

/// Phases at which members are asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum At {
    /// Each at its own.
    Own,
    /// Each at its own, the motion resting before its start and after its end.
    OwnWithin,
    /// All at this one.
    Phase(f64),
}

impl Predictor {
    pub(crate) fn new(model: &Model) -> Self {
        let largest = |f: fn(&crate::orthonormal::OrthonormalBasis) -> usize| {
            model.bases.iter().map(f).max().unwrap_or(0)
        };
        let (size, count) = (largest(|b| b.size()), largest(|b| b.basis().count()));
        Self {
            functions: model
                .bases
                .iter()
                .map(|b| vec![[0.0; LANES]; b.size()])
                .collect(),
            needed: vec![false; model.bases.len()],
            coefficients: vec![[0.0; LANES]; model.rank],
            values: vec![0.0; size],
            slopes: vec![0.0; size],
            raw: vec![0.0; 2 * count],
            model: model.clone(),
        }
    }

    pub(crate) fn dofs(&self) -> usize {
        self.model.dofs()
    }

    /// Degree of freedom `dofs[i]` of every member of `state` into row `i` of `out`.
    pub(crate) fn predict(&mut self, state: &Table, at: At, dofs: &[usize], out: &mut Table) {
        self.needed.fill(false);
        for d in dofs {
            self.needed[self.model.layout[*d].group] = true;
        }
        if let At::Phase(phase) = at {
            self.evaluate(0..LANES, phase);
        }
        for t in 0..state.width {
            if !matches!(at, At::Phase(_)) {
                for lane in 0..LANES {
                    let own = state.tiles(0)[t][lane];
                    let phase = if at == At::OwnWithin {
                        own.clamp(0.0, 1.0)
                    } else {
                        own
                    };
                    self.evaluate(lane..lane + 1, phase);
                }
            }
            for (c, tile) in self.coefficients.iter_mut().enumerate() {
                *tile = state.tiles(PHASE_STATES + c)[t];
            }
            Arch::new().dispatch(Eight {
                predictor: self,
                dofs,
                t,
                out,
            });
        }
    }

    /// Functions of all groups that are needed, the same phase in several lanes.
    fn evaluate(&mut self, lanes: std::ops::Range<usize>, phase: f64) {
        for (group, basis) in self.model.bases.iter().enumerate() {
            if !self.needed[group] {
                continue;
            }
            let values = &mut self.values[..basis.size()];
            basis.evaluate_into(
                phase,
                &mut self.raw[..2 * basis.basis().count()],
                values,
                &mut self.slopes[..basis.size()],
            );
            for (tile, value) in self.functions[group].iter_mut().zip(values) {
                tile[lanes.clone()].fill(*value);
            }
        }
    }
}

/// The work of [`Predictor::predict`] on eight members, compiled once more for wide vectors.
struct Eight<'a> {
    predictor: &'a Predictor,
    dofs: &'a [usize],
    t: usize,
    out: &'a mut Table,
}

impl WithSimd for Eight<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let p = self.predictor;
        for (i, &d) in self.dofs.iter().enumerate() {
            let dof = p.model.layout[d];
            let functions = &p.functions[dof.group][..];
            let mut value = [p.model.offset[d]; LANES];
            let (fours, rest) = functions.as_chunks::<4>();
            let mut weight = dof.first_weight;
            for four in fours {
                add_weighted::<S, 4>(&mut value, p, weight, four);
                weight += 4;
            }
            for one in rest {
                add_weighted::<S, 1>(&mut value, p, weight, &[*one]);
                weight += 1;
            }
            self.out.tiles_mut(i)[self.t] = value;
        }
    }
}

/// `value += Σ_n functions[n] · w_n` with the weights `w = mean + U c` of eight members, `N` of
/// them at a time because each is a chain of additions that wait for each other.
#[inline(always)]
fn add_weighted<S: Simd, const N: usize>(
    value: &mut Tile,
    p: &Predictor,
    first: usize,
    functions: &[Tile; N],
) {
    let rank = p.model.rank;
    let mut weights: [Tile; N] = std::array::from_fn(|n| [p.model.mean[first + n]; LANES]);
    let rows: [&[f64]; N] =
        std::array::from_fn(|n| &p.model.factor[(first + n) * rank..(first + n + 1) * rank]);
    for (c, column) in p.coefficients[..rank].iter().enumerate() {
        for (w, row) in weights.iter_mut().zip(&rows) {
            add_multiple::<S>(w, row[c], column);
        }
    }
    for (w, f) in weights.iter().zip(functions) {
        for l in 0..LANES {
            value[l] += f[l] * w[l];
        }
    }
}

struct AddMultiple<'a> {
    to: &'a mut [Tile],
    factor: f64,
    from: &'a [Tile],
}

impl WithSimd for AddMultiple<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            add_multiple::<S>(to, self.factor, from);
        }
    }
}

struct Dot<'a> {
    a: &'a [Tile],
    b: &'a [Tile],
}

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sum = [0.0; LANES];
        for (a, b) in self.a.iter().zip(self.b) {
            for l in 0..LANES {
                sum[l] = if S::IS_SCALAR {
                    sum[l] + a[l] * b[l]
                } else {
                    a[l].mul_add(b[l], sum[l])
                };
            }
        }
        lane_sum(&sum)
    }
}
