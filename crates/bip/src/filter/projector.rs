//! Rows of the measurement matrix: only what is observed, only in the span of the demonstrations.

use crate::Model;
use crate::model::DofLayout;
use crate::orthonormal::OrthonormalBasis;
use crate::square_root::{LANES, Tile, add_multiple, lane_sum, tiles};
use faer::traits::pulp::{Arch, Simd, WithSimd};

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
    pub(crate) fn row(&self, d: usize, state: &[Tile], tile: impl FnMut(usize, Tile)) -> Predicted {
        Arch::new().dispatch(Row {
            projector: self,
            d,
            state,
            tile,
        })
    }
}

/// The work of [`Projector::row`], compiled once more for wide vectors.
struct Row<'a, F> {
    projector: &'a Projector,
    d: usize,
    state: &'a [Tile],
    tile: F,
}

impl<F: FnMut(usize, Tile)> WithSimd for Row<'_, F> {
    type Output = Predicted;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Predicted {
        let p = self.projector;
        let dof = p.layout[self.d];
        let (values, slopes) = (&p.values[dof.group][..], &p.slopes[dof.group][..]);
        let size = values.len();
        let mut value: Tile = [0.0; LANES];
        let mut slope: Tile = [0.0; LANES];
        let start = dof.first_weight * p.width;
        let blocks = p.factor[start..start + size * p.width].chunks_exact(size);
        for (t, (block, x)) in blocks.zip(self.state).enumerate() {
            let mut h: Tile = [0.0; LANES];
            let mut g: Tile = [0.0; LANES];
            for ((u, v), s) in block.iter().zip(values).zip(slopes) {
                add_multiple::<S>(&mut h, *v, u);
                add_multiple::<S>(&mut g, *s, u);
            }
            for l in 0..LANES {
                value[l] += h[l] * x[l];
                slope[l] += g[l] * x[l];
            }
            (self.tile)(t, h);
        }
        let mean = &p.mean[dof.first_weight..dof.first_weight + size];
        Predicted {
            value: p.offset[self.d] + crate::dense::dot(values, mean) + lane_sum(&value),
            slope: crate::dense::dot(slopes, mean) + lane_sum(&slope),
        }
    }
}
