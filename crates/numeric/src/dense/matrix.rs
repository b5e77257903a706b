//! A dense matrix.

use std::ops::{Index, IndexMut};

/// A dense matrix of `f64`, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    entries: Vec<f64>,
}

impl Matrix {
    /// A matrix of zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self::from_rows(rows, columns, vec![0.0; rows * columns])
    }

    /// The identity matrix.
    #[must_use]
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |i, j| f64::from(u8::from(i == j)))
    }

    /// From its entries, row by row.
    ///
    /// # Panics
    /// If there are not `rows * columns` entries.
    #[must_use]
    pub fn from_rows(rows: usize, columns: usize, entries: Vec<f64>) -> Self {
        assert_eq!(entries.len(), rows * columns, "{rows} x {columns} entries");
        Self {
            rows,
            columns,
            entries,
        }
    }

    /// From a function of row and column.
    #[must_use]
    pub fn from_fn(
        rows: usize,
        columns: usize,
        mut entry: impl FnMut(usize, usize) -> f64,
    ) -> Self {
        let mut entries = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            for j in 0..columns {
                entries.push(entry(i, j));
            }
        }
        Self::from_rows(rows, columns, entries)
    }

    /// Number of rows.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// All entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// All entries, row by row.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// All entries, row by row.
    #[must_use]
    pub fn into_entries(self) -> Vec<f64> {
        self.entries
    }

    /// One row.
    #[must_use]
    #[inline]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.entries[i * self.columns..(i + 1) * self.columns]
    }

    /// One row.
    #[inline]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.entries[i * self.columns..(i + 1) * self.columns]
    }

    /// Rows `p < q`.
    pub(super) fn two_rows_mut(&mut self, p: usize, q: usize) -> (&mut [f64], &mut [f64]) {
        let (before, from_q) = self.entries.split_at_mut(q * self.columns);
        (
            &mut before[p * self.columns..][..self.columns],
            &mut from_q[..self.columns],
        )
    }

    /// All rows before row `i`, and row `i`.
    pub(super) fn split_at_row_mut(&mut self, i: usize) -> (&[f64], &mut [f64]) {
        let (before, from) = self.entries.split_at_mut(i * self.columns);
        (before, &mut from[..self.columns])
    }

    /// The transpose.
    #[must_use]
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)])
    }

    /// `self * other`.
    ///
    /// # Panics
    /// If the number of rows of `other` differs from the number of columns of `self`.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        assert_eq!(self.columns, other.rows, "columns and rows of a product");
        let mut product = Self::zeros(self.rows, other.columns);
        for i in 0..self.rows {
            let out = &mut product.entries[i * other.columns..(i + 1) * other.columns];
            for (k, &factor) in self.row(i).iter().enumerate() {
                add_multiple(out, factor, other.row(k));
            }
        }
        product
    }

    /// `selfᵀ * other`, without forming the transpose.
    ///
    /// # Panics
    /// If the numbers of rows differ.
    #[must_use]
    pub fn transpose_times(&self, other: &Self) -> Self {
        assert_eq!(self.rows, other.rows, "rows of a product");
        let mut product = Self::zeros(self.columns, other.columns);
        for k in 0..self.rows {
            for (i, &factor) in self.row(k).iter().enumerate() {
                add_multiple(product.row_mut(i), factor, other.row(k));
            }
        }
        product
    }

    /// `selfᵀ * self`, exactly symmetric.
    #[must_use]
    pub fn gram(&self) -> Self {
        let n = self.columns;
        let mut gram = Self::zeros(n, n);
        for k in 0..self.rows {
            let row = self.row(k);
            for (i, &factor) in row.iter().enumerate() {
                add_multiple(&mut gram.row_mut(i)[i..], factor, &row[i..]);
            }
        }
        for i in 0..n {
            for j in 0..i {
                gram[(i, j)] = gram[(j, i)];
            }
        }
        gram
    }

    /// Adds `factor * other`, entry by entry.
    ///
    /// # Panics
    /// If the shapes differ.
    pub fn add(&mut self, factor: f64, other: &Self) {
        assert_eq!(
            (self.rows, self.columns),
            (other.rows, other.columns),
            "shapes of a sum"
        );
        add_multiple(&mut self.entries, factor, &other.entries);
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;
    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.row(i)[j]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.row_mut(i)[j]
    }
}

/// `to += factor * from`.
#[inline]
pub(super) fn add_multiple(to: &mut [f64], factor: f64, from: &[f64]) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += factor * f;
    }
}
