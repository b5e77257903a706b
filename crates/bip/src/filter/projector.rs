//! Rows of the measurement matrix, only for observed values, in the span of the demonstrations.

use super::posterior::PHASE_STATES;
use crate::arithmetic::{AlignedTile, LANES, Tile, add_multiple, lane_sum, tiles};
use crate::model::{Model, WeightLayout};
use hwall_numeric::dense::dot;
use pulp::{Arch, Simd, WithSimd};

/// Prediction of one degree of freedom at one phase, and its derivative with respect to phase.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Predicted {
    pub value: f64,
    pub slope: f64,
}

/// The model laid out for fast rows, with scratch for evaluating a basis.
#[derive(Debug, Clone)]
pub(super) struct Projector {
    width: usize,
    layout: WeightLayout,
    offset: Vec<f64>,
    mean: Vec<f64>,
    /// Factor in state columns. For each degree of freedom: tile by tile, with the weights in order.
    factor: Vec<AlignedTile>,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
    raw: Vec<f64>,
}

impl Projector {
    pub(super) fn new(model: &Model) -> Self {
        let parts = model.parts();
        let layout = parts.layout.clone();
        let width = tiles(PHASE_STATES + model.rank());
        let mut factor = vec![AlignedTile::ZERO; layout.weights() * width];
        for d in 0..layout.dofs() {
            let weights = layout.range(d);
            for (b, w) in weights.clone().enumerate() {
                for (c, u) in parts.factor.row(w).iter().enumerate() {
                    let column = PHASE_STATES + c;
                    let tile = weights.start * width + (column / LANES) * weights.len() + b;
                    factor[tile][column % LANES] = *u;
                }
            }
        }
        let bases = layout.bases();
        let empty: Vec<Vec<f64>> = bases.iter().map(|b| vec![0.0; b.size()]).collect();
        let scratch = bases.iter().map(|b| b.scratch_len()).max();
        Self {
            width,
            values: empty.clone(),
            slopes: empty,
            raw: vec![0.0; scratch.unwrap_or(0)],
            layout,
            offset: parts.offset.clone(),
            mean: parts.mean.clone(),
            factor,
        }
    }

    pub(super) fn dofs(&self) -> usize {
        self.layout.dofs()
    }

    /// Evaluates all bases at this phase, for the rows that follow.
    pub(super) fn set_phase(&mut self, phase: f64) {
        for (group, basis) in self.layout.bases().iter().enumerate() {
            basis.evaluate_into(
                phase,
                &mut self.raw,
                &mut self.values[group],
                &mut self.slopes[group],
            );
        }
    }

    /// Passes the row of degree of freedom `d` in the coefficients to `tile`, tile by tile, and returns its prediction for the padded `state`,
    /// whose first two entries are ignored.
    pub(super) fn row(&self, d: usize, state: &[Tile], tile: impl FnMut(usize, Tile)) -> Predicted {
        Arch::new().dispatch(Row {
            projector: self,
            d,
            state,
            tile,
        })
    }
}

/// The work of [`Projector::row`], compiled once for any machine and once for wide vectors.
struct Row<'a, F> {
    projector: &'a Projector,
    d: usize,
    state: &'a [Tile],
    tile: F,
}

impl<F: FnMut(usize, Tile)> WithSimd for Row<'_, F> {
    type Output = Predicted;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Predicted {
        let p = self.projector;
        let (group, weights) = (p.layout.group(self.d), p.layout.range(self.d));
        let (values, slopes) = (&p.values[group][..], &p.slopes[group][..]);
        let mut value: Tile = [0.0; LANES];
        let mut slope: Tile = [0.0; LANES];
        let tiles = weights.start * p.width..weights.end * p.width;
        let blocks = p.factor[tiles].chunks_exact(values.len());
        for (t, (block, x)) in blocks.zip(self.state).enumerate() {
            let (h, g) = combined(simd, block, values, slopes);
            for l in 0..LANES {
                value[l] += h[l] * x[l];
                slope[l] += g[l] * x[l];
            }
            (self.tile)(t, h);
        }
        let mean = &p.mean[weights];
        Predicted {
            value: p.offset[self.d] + dot(values, mean) + lane_sum(&value),
            slope: dot(slopes, mean) + lane_sum(&slope),
        }
    }
}

/// The sums of the tiles of a block, weighted by values and by slopes.
#[inline(always)]
fn combined<S: Simd>(
    simd: S,
    block: &[AlignedTile],
    values: &[f64],
    slopes: &[f64],
) -> (Tile, Tile) {
    let mut h: Tile = [0.0; LANES];
    let mut g: Tile = [0.0; LANES];
    if S::F64_LANES == LANES {
        // Explicit vectors, as in the update.
        let splat = |x: f64| simd.splat_f64s(x);
        let (mut by_value, mut by_slope) = (splat(0.0), splat(0.0));
        for ((u, v), s) in block.iter().zip(values).zip(slopes) {
            let u = S::as_simd_f64s(&u.0).0[0];
            by_value = simd.mul_add_e_f64s(splat(*v), u, by_value);
            by_slope = simd.mul_add_e_f64s(splat(*s), u, by_slope);
        }
        S::as_mut_simd_f64s(&mut h).0[0] = by_value;
        S::as_mut_simd_f64s(&mut g).0[0] = by_slope;
        return (h, g);
    }
    for ((u, v), s) in block.iter().zip(values).zip(slopes) {
        add_multiple::<S>(&mut h, *v, u);
        add_multiple::<S>(&mut g, *s, u);
    }
    (h, g)
}
