//! Predictions of the members of an ensemble.

use super::table::Table;
use crate::arithmetic::{LANES, Tile, add_multiple, vectorize};
use crate::filter::PHASE_STATES;
use crate::model::Model;
use pulp::{Simd, WithSimd};

/// The model with scratch for the predictions of members.
#[derive(Debug, Clone)]
pub(super) struct Predictor {
    model: Model,
    /// For each group: its functions at the phases of eight members.
    functions: Vec<Vec<Tile>>,
    needed: Vec<bool>,
    /// Coefficients of eight members.
    coefficients: Vec<Tile>,
    values: Vec<f64>,
    slopes: Vec<f64>,
    raw: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PredictedPhase {
    /// Each at its own phase.
    Own,
    /// Each at its own phase; the motion rests before its start and after its end.
    OwnWithin,
    /// All at this phase.
    Given(f64),
}

impl Predictor {
    pub(super) fn new(model: &Model) -> Self {
        let bases = model.parts().layout.bases();
        let size = bases.iter().map(|b| b.size()).max().unwrap_or(0);
        let scratch = bases.iter().map(|b| b.scratch_len()).max().unwrap_or(0);
        Self {
            functions: bases.iter().map(|b| vec![[0.0; LANES]; b.size()]).collect(),
            needed: vec![false; bases.len()],
            coefficients: vec![[0.0; LANES]; model.rank()],
            values: vec![0.0; size],
            slopes: vec![0.0; size],
            raw: vec![0.0; scratch],
            model: model.clone(),
        }
    }

    pub(super) fn dofs(&self) -> usize {
        self.model.dofs()
    }

    /// Writes degree of freedom `dofs[i]` of every member of `state` to row `i` of `out`.
    pub(super) fn predict(
        &mut self,
        state: &Table,
        at: PredictedPhase,
        dofs: &[usize],
        out: &mut Table,
    ) {
        self.needed.fill(false);
        for d in dofs {
            self.needed[self.model.parts().layout.group(*d)] = true;
        }
        if let PredictedPhase::Given(phase) = at {
            self.evaluate(0..LANES, phase);
        }
        for t in 0..state.width() {
            if !matches!(at, PredictedPhase::Given(_)) {
                for lane in 0..LANES {
                    let own = state.tiles(0)[t][lane];
                    let phase = if at == PredictedPhase::OwnWithin {
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
            vectorize(Eight {
                predictor: self,
                dofs,
                t,
                out,
            });
        }
    }

    /// Evaluates the functions of all required groups, at one phase, in the given lanes.
    fn evaluate(&mut self, lanes: std::ops::Range<usize>, phase: f64) {
        for (group, basis) in self.model.parts().layout.bases().iter().enumerate() {
            if !self.needed[group] {
                continue;
            }
            let values = &mut self.values[..basis.size()];
            basis.evaluate_into(
                phase,
                &mut self.raw,
                values,
                &mut self.slopes[..basis.size()],
            );
            for (tile, value) in self.functions[group].iter_mut().zip(values) {
                tile[lanes.clone()].fill(*value);
            }
        }
    }
}

/// The work of [`Predictor::predict`] on eight members, also compiled for wide vectors.
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
        let parts = p.model.parts();
        for (i, &d) in self.dofs.iter().enumerate() {
            let functions = &p.functions[parts.layout.group(d)][..];
            let mut value = [parts.offset[d]; LANES];
            let (fours, rest) = functions.as_chunks::<4>();
            let mut weight = parts.layout.range(d).start;
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

/// `value += Σ_n functions[n] · w_n` with the weights `w = mean + U c` of eight members, in `N` independent chains of additions.
#[inline(always)]
fn add_weighted<S: Simd, const N: usize>(
    value: &mut Tile,
    p: &Predictor,
    first: usize,
    functions: &[Tile; N],
) {
    let parts = p.model.parts();
    let mut weights: [Tile; N] = std::array::from_fn(|n| [parts.mean[first + n]; LANES]);
    let rows: [&[f64]; N] = std::array::from_fn(|n| parts.factor.row(first + n));
    for (c, column) in p.coefficients.iter().enumerate() {
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
