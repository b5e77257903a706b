//! Rows of the measurement matrix: only what is observed, only in the span of the demonstrations.

use crate::Model;
use crate::model::DofLayout;
use crate::orthonormal::OrthonormalBasis;
use crate::square_root::{LANES, Tile, lane_sum, tiles};

/// Entries of the state before the coefficients: phase and phase velocity.
pub(crate) const PHASE_STATES: usize = 2;

/// Prediction of one degree of freedom at one phase, and its derivative by phase.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Predicted {
    pub(crate) value: f64,
    pub(crate) slope: f64,
}

/// The model laid out for fast rows, with the scratch that evaluating a basis needs.
#[derive(Debug, Clone)]
pub(crate) struct Projector {
    width: usize,
    bases: Vec<OrthonormalBasis>,
    layout: Vec<DofLayout>,
    offset: Vec<f64>,
    mean: Vec<f64>,
    /// Factor in state columns. Per degree of freedom: tile after tile, in each the weights in order.
    factor: Vec<Tile>,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
    raw: Vec<f64>,
}

impl Projector {
    pub(crate) fn new(model: &Model) -> Self {
        let width = tiles(PHASE_STATES + model.rank);
        let mut factor = vec![[0.0; LANES]; model.mean.len() * width];
        for dof in &model.layout {
            let size = model.bases[dof.group].size();
            for b in 0..size {
                for c in 0..model.rank {
                    let column = PHASE_STATES + c;
                    let tile = dof.first_weight * width + (column / LANES) * size + b;
                    factor[tile][column % LANES] =
                        model.factor[(dof.first_weight + b) * model.rank + c];
                }
            }
        }
        let empty = |b: &OrthonormalBasis| vec![0.0; b.size()];
        let largest = model.bases.iter().map(|b| b.basis().count()).max();
        Self {
            width,
            values: model.bases.iter().map(empty).collect(),
            slopes: model.bases.iter().map(empty).collect(),
            raw: vec![0.0; 2 * largest.unwrap_or(0)],
            bases: model.bases.clone(),
            layout: model.layout.clone(),
            offset: model.offset.clone(),
            mean: model.mean.clone(),
            factor,
        }
    }

    pub(crate) fn dofs(&self) -> usize {
        self.layout.len()
    }

    /// Evaluates all bases; the other functions then speak about this phase.
    pub(crate) fn set_phase(&mut self, phase: f64) {
        for (group, basis) in self.bases.iter().enumerate() {
            basis.evaluate_into(
                phase,
                &mut self.raw[..2 * basis.basis().count()],
                &mut self.values[group],
                &mut self.slopes[group],
            );
        }
    }

    /// Row of degree of freedom `d` on the coefficients, handed out tile by tile, and its
    /// prediction for the padded `state` (whose first two entries do not matter).
    pub(crate) fn row(
        &self,
        d: usize,
        state: &[Tile],
        mut tile: impl FnMut(usize, Tile),
    ) -> Predicted {
        let dof = self.layout[d];
        let (values, slopes) = (&self.values[dof.group], &self.slopes[dof.group]);
        let size = values.len();
        let mut value: Tile = [0.0; LANES];
        let mut slope: Tile = [0.0; LANES];
        let start = dof.first_weight * self.width;
        let blocks = self.factor[start..start + size * self.width].chunks_exact(size);
        for (t, (block, x)) in blocks.zip(state).enumerate() {
            let mut h: Tile = [0.0; LANES];
            let mut g: Tile = [0.0; LANES];
            for ((u, v), s) in block.iter().zip(values).zip(slopes) {
                for l in 0..LANES {
                    h[l] += v * u[l];
                    g[l] += s * u[l];
                }
            }
            for l in 0..LANES {
                value[l] += h[l] * x[l];
                slope[l] += g[l] * x[l];
            }
            tile(t, h);
        }
        let mean = &self.mean[dof.first_weight..dof.first_weight + size];
        Predicted {
            value: self.offset[d] + crate::dense::dot(values, mean) + lane_sum(&value),
            slope: crate::dense::dot(slopes, mean) + lane_sum(&slope),
        }
    }
}
