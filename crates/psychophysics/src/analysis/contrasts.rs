//! Orthonormal contrasts of a factorial design.
//!
//! The cells of every subject are multiplied by an orthonormal matrix, the Kronecker product of one small
//! matrix per factor: its first row is the mean (times √k), the others are Helmert contrasts. Each
//! coefficient belongs to exactly one effect within subjects: the effect of the factors for which it uses
//! a contrast row. All sums of squares of a balanced design are sums over such coefficients.

/// Sizes of a design, and the effect of each coefficient.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contrasts {
    sizes: Vec<usize>,
    /// One orthonormal matrix per factor, row by row.
    matrices: Vec<Vec<f64>>,
    /// Coefficients of each effect; bit f of the index: factor f is part of it.
    members: Vec<Vec<usize>>,
}

impl Contrasts {
    /// For factors with these numbers of levels, the last one fastest.
    pub(super) fn new(sizes: &[usize]) -> Self {
        let cells: usize = sizes.iter().product();
        let mut members = vec![Vec::new(); 1 << sizes.len()];
        for cell in 0..cells {
            let mut rest = cell;
            let mut mask = 0;
            for (factor, size) in sizes.iter().enumerate().rev() {
                if rest % size > 0 {
                    mask |= 1 << factor;
                }
                rest /= size;
            }
            members[mask].push(cell);
        }
        Self {
            sizes: sizes.to_vec(),
            matrices: sizes.iter().map(|&k| helmert(k)).collect(),
            members,
        }
    }

    /// Number of effects, including that of the mean (index 0).
    pub(super) fn effects(&self) -> usize {
        self.members.len()
    }

    /// Coefficients of an effect.
    pub(super) fn members(&self, mask: usize) -> &[usize] {
        &self.members[mask]
    }

    /// Transforms the cells of one subject into coefficients; `scratch` has the same length.
    pub(super) fn apply(&self, cells: &mut [f64], scratch: &mut [f64]) {
        let mut stride = cells.len();
        for (&k, matrix) in self.sizes.iter().zip(&self.matrices) {
            stride /= k;
            scratch.copy_from_slice(cells);
            for start in (0..cells.len()).step_by(stride * k) {
                for offset in 0..stride {
                    let first = start + offset;
                    for (row, weights) in matrix.chunks_exact(k).enumerate() {
                        let terms = weights.iter().enumerate();
                        cells[first + row * stride] =
                            terms.map(|(j, w)| w * scratch[first + j * stride]).sum();
                    }
                }
            }
        }
    }
}

/// Orthonormal rows: equal weights, then the mean of the first levels against the next level.
fn helmert(k: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; k * k];
    matrix[..k].fill(1.0 / (k as f64).sqrt());
    for row in 1..k {
        let scale = ((row * (row + 1)) as f64).sqrt().recip();
        matrix[row * k..row * k + row].fill(scale);
        matrix[row * k + row] = -(row as f64) * scale;
    }
    matrix
}
