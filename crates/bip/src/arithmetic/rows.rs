//! Rows of evidence.

use super::tile::{AlignedTile, LANES, Tile, lane_sum, tiles};

/// Rows `A x = e` of evidence with unit noise, stored tile by tile: a tile column is contiguous.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    capacity: usize,
    pub(super) len: usize,
    /// The tiles of all rows for the first columns, then the tiles of all rows for the next columns, and so on.
    pub(super) a: Vec<AlignedTile>,
    /// Right-hand sides.
    pub(crate) e: Vec<f64>,
}

impl Rows {
    pub(crate) fn new(n: usize, capacity: usize) -> Self {
        Self {
            capacity,
            len: 0,
            a: vec![AlignedTile::ZERO; tiles(n) * capacity],
            e: vec![0.0; capacity],
        }
    }

    /// Takes `len` rows; their old contents stay until overwritten.
    pub(crate) fn reset(&mut self, len: usize) {
        debug_assert!(len <= self.capacity);
        self.len = len;
    }

    /// Largest number of rows.
    pub(crate) fn capacity(&self) -> usize {
        self.capacity
    }

    /// Zeroes a row.
    pub(crate) fn clear(&mut self, row: usize) {
        for column in self.a.chunks_exact_mut(self.capacity) {
            column[row] = AlignedTile::ZERO;
        }
    }

    pub(crate) fn tile_mut(&mut self, row: usize, tile: usize) -> &mut Tile {
        &mut self.a[tile * self.capacity + row]
    }

    pub(crate) fn tile(&self, row: usize, tile: usize) -> &Tile {
        &self.a[tile * self.capacity + row]
    }

    /// Dot product of two rows of `width` tiles.
    pub(crate) fn dot(&self, i: usize, j: usize, width: usize) -> f64 {
        let mut sum: Tile = [0.0; LANES];
        for column in self.a.chunks_exact(self.capacity).take(width) {
            for ((s, a), b) in sum.iter_mut().zip(&column[i].0).zip(&column[j].0) {
                *s += a * b;
            }
        }
        lane_sum(&sum)
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.tile_mut(row, column / LANES)[column % LANES] = value;
    }

    /// Divides rows by a lower triangular matrix (row-major, `len × len`) from the left: converts evidence with covariance `L Lᵀ` to unit noise.
    pub(crate) fn whiten(&mut self, lower: &[f64]) {
        let m = self.len;
        for column in self.a.chunks_exact_mut(self.capacity) {
            for i in 0..m {
                for j in 0..i {
                    let l = lower[i * m + j];
                    let from = column[j];
                    for (x, y) in column[i].iter_mut().zip(from.0) {
                        *x -= l * y;
                    }
                }
                for x in column[i].iter_mut() {
                    *x /= lower[i * m + i];
                }
            }
        }
        for i in 0..m {
            for j in 0..i {
                self.e[i] -= lower[i * m + j] * self.e[j];
            }
            self.e[i] /= lower[i * m + i];
        }
    }
}
