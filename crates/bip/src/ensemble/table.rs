//! The members of an ensemble: one row per variable, eight members per tile.

use crate::arithmetic::{LANES, Tile, add_multiple, all_finite, lane_sum, tiles, vectorize};
use pulp::{Simd, WithSimd};

/// A table with one row per variable and one column per member. Columns are padded to whole tiles; only [`Table::product`] reads the padding, which
/// must be zero there.
#[derive(Debug, Clone)]
pub(super) struct Table {
    members: usize,
    width: usize,
    entries: Vec<Tile>,
}

impl Table {
    /// All zero.
    pub(super) fn new(rows: usize, members: usize) -> Self {
        let width = tiles(members);
        Self {
            members,
            width,
            entries: vec![[0.0; LANES]; rows * width],
        }
    }

    /// Number of tiles of a row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn members(&self) -> usize {
        self.members
    }

    pub(super) fn tiles(&self, row: usize) -> &[Tile] {
        &self.entries[row * self.width..(row + 1) * self.width]
    }

    pub(super) fn tiles_mut(&mut self, row: usize) -> &mut [Tile] {
        &mut self.entries[row * self.width..(row + 1) * self.width]
    }

    /// One variable of all members, without the padding.
    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.tiles(row).as_flattened()[..self.members]
    }

    pub(super) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        let members = self.members;
        &mut self.tiles_mut(row).as_flattened_mut()[..members]
    }

    /// The first two rows.
    pub(super) fn top_two_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        let (first, rest) = self.entries.split_at_mut(self.width);
        let second = &mut rest[..self.width];
        (
            &mut first.as_flattened_mut()[..self.members],
            &mut second.as_flattened_mut()[..self.members],
        )
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.entries.copy_from_slice(&other.entries);
    }

    /// Copies the first rows.
    pub(super) fn copy_rows_from(&mut self, other: &Self, rows: usize) {
        let count = rows * self.width;
        self.entries[..count].copy_from_slice(&other.entries[..count]);
    }

    /// Are the first rows finite?
    pub(super) fn is_finite(&self, rows: usize) -> bool {
        (0..rows).all(|k| all_finite(self.row(k)))
    }

    pub(super) fn mean(&self, row: usize) -> f64 {
        let row = self.row(row);
        row.iter().sum::<f64>() / row.len() as f64
    }

    /// Sample covariance of two rows, with `members - 1`.
    pub(super) fn covariance(&self, i: usize, j: usize) -> f64 {
        let (mean_i, mean_j) = (self.mean(i), self.mean(j));
        let rows = self.row(i).iter().zip(self.row(j));
        rows.map(|(a, b)| (a - mean_i) * (b - mean_j)).sum::<f64>() / (self.members - 1) as f64
    }

    /// Subtracts the mean of a row and clears its padding; returns the mean.
    pub(super) fn centre(&mut self, row: usize) -> f64 {
        let mean = self.mean(row);
        let members = self.members;
        let all = self.tiles_mut(row).as_flattened_mut();
        all[..members].iter_mut().for_each(|x| *x -= mean);
        all[members..].fill(0.0);
        mean
    }

    pub(super) fn scale(&mut self, row: usize, factor: f64) {
        self.tiles_mut(row)
            .as_flattened_mut()
            .iter_mut()
            .for_each(|x| *x *= factor);
    }

    /// `row[to] += factor · row[from]`; `to` and `from` must differ.
    fn add_row(&mut self, to: usize, factor: f64, from: usize) {
        let width = self.width;
        let (low, high) = self.entries.split_at_mut(to.max(from) * width);
        let (low, high) = (
            &mut low[to.min(from) * width..][..width],
            &mut high[..width],
        );
        let (to, from) = if to < from { (low, high) } else { (high, low) };
        vectorize(AddMultiple { to, factor, from });
    }

    /// `row[to] += Σ_i factors[i] · other.row[i]`.
    pub(super) fn add_combination(&mut self, to: usize, factors: &[f64], other: &Self) {
        for (i, factor) in factors.iter().enumerate() {
            vectorize(AddMultiple {
                to: self.tiles_mut(to),
                factor: *factor,
                from: other.tiles(i),
            });
        }
    }

    /// Sum over the members of the products of a row of this table and a row of another.
    pub(super) fn product(&self, row: usize, other: &Self, other_row: usize) -> f64 {
        vectorize(Dot {
            a: self.tiles(row),
            b: other.tiles(other_row),
        })
    }

    /// Divides the first `m` rows by a lower triangular `m × m` matrix from the left, with `shift` added to its diagonal.
    pub(super) fn divide_lower(&mut self, m: usize, lower: &[f64], shift: f64) {
        for i in 0..m {
            for j in 0..i {
                self.add_row(i, -lower[i * m + j], j);
            }
            self.scale(i, 1.0 / (lower[i * m + i] + shift));
        }
    }

    /// Divides the first `m` rows by the transpose of a lower triangular matrix from the left.
    pub(super) fn divide_transposed(&mut self, m: usize, lower: &[f64]) {
        for i in (0..m).rev() {
            for j in i + 1..m {
                self.add_row(i, -lower[j * m + i], j);
            }
            self.scale(i, 1.0 / lower[i * m + i]);
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
