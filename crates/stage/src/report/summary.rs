//! The numbers that a run is judged by.

use crate::run::judged::regret::Miss;
use crate::run::people::{JudgedTouch, PersonRun};
use hwall_testkit::quantile;
use std::collections::BTreeMap;

/// A first contact with a face that is faster counts as a blow, m/s.
pub const FAST_M_PER_S: f64 = 0.1;

/// All touches of all people in a few numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// People who touched.
    pub people: usize,
    /// Their touches.
    pub touches: usize,
    /// Touches that the arm can reach.
    pub reachable: usize,
    /// Touches at which the board could have been in time.
    pub possible: usize,
    /// Touches within reach at which the board was there before the hand.
    pub in_place: usize,
    /// Possible touches at which it was.
    pub possible_in_place: usize,
    /// Distance of the face from the touched point along the normal, of the touches within reach, m; `None` without any.
    pub gap_median_m: Option<f64>,
    /// Nine of ten are not larger, m.
    pub gap_p90_m: Option<f64>,
    /// From the arrival of the hand until the touch was felt, of the touches that were felt, s.
    pub felt_median_s: Option<f64>,
    /// Of all touches that met the board, the share in which it was faster than [`FAST_M_PER_S`] at first.
    pub met_fast: Option<f64>,
    /// Times that a board turned back before a touch.
    pub reversals_median: Option<f64>,
    /// Boards sent in vain for each touch.
    pub in_vain_per_touch: Option<f64>,
    /// Touches at which the board was not in place, by [`Miss::ALL`].
    pub misses: [usize; Miss::ALL.len()],
    /// Of these touches those before which the arm was stopped, by what stopped it.
    pub stops: BTreeMap<String, usize>,
    /// Time of a control step that 99 of 100 do not exceed, us.
    pub step_p99_us: Option<f64>,
}

impl Summary {
    /// Of all touches in these runs.
    #[must_use]
    pub fn new(runs: &[PersonRun]) -> Self {
        let touches: Vec<&JudgedTouch> = runs.iter().flat_map(|run| &run.touches).collect();
        let reachable: Vec<&JudgedTouch> = touches
            .iter()
            .copied()
            .filter(|t| t.outcome.unreachable.is_none())
            .collect();
        let count = |what: &dyn Fn(&JudgedTouch) -> bool| {
            reachable.iter().copied().filter(|t| what(t)).count()
        };
        let gaps_m = sorted(reachable.iter().map(|t| t.outcome.gap_m));
        let felt_s = sorted(reachable.iter().filter_map(|t| t.outcome.felt_after_s));
        let met: Vec<f64> = touches
            .iter()
            .filter_map(|t| t.outcome.met_m_per_s)
            .collect();
        let fast = met.iter().filter(|m_per_s| **m_per_s > FAST_M_PER_S);
        let reversals = sorted(touches.iter().map(|t| t.regret.detours.reversals as f64));
        let in_vain: usize = touches.iter().map(|t| t.regret.detours.in_vain).sum();
        let mut stops = BTreeMap::new();
        for stop in touches.iter().filter_map(|t| t.regret.stopped_by) {
            *stops.entry(stop.to_string()).or_default() += 1;
        }
        let step_ns = sorted(
            runs.iter()
                .flat_map(|run| run.run.costs.iter().map(|cost| f64::from(cost.step_ns))),
        );
        Self {
            people: runs.len(),
            touches: touches.len(),
            reachable: reachable.len(),
            possible: count(&|t| t.regret.possible),
            in_place: count(&|t| t.outcome.in_place()),
            possible_in_place: count(&|t| t.regret.possible && t.outcome.in_place()),
            gap_median_m: at(&gaps_m, 0.5),
            gap_p90_m: at(&gaps_m, 0.9),
            felt_median_s: at(&felt_s, 0.5),
            met_fast: share(fast.count(), met.len()),
            reversals_median: at(&reversals, 0.5),
            in_vain_per_touch: share(in_vain, touches.len()),
            misses: Miss::ALL.map(|miss| {
                let missed = |t: &&&JudgedTouch| t.regret.miss == Some(miss);
                touches.iter().filter(missed).count()
            }),
            stops,
            step_p99_us: at(&step_ns, 0.99).map(|ns| 1e-3 * ns),
        }
    }

    /// Share of the touches within reach at which the board was in place; `None` without any.
    #[must_use]
    pub fn in_place_of_reachable(&self) -> Option<f64> {
        share(self.in_place, self.reachable)
    }

    /// Share of the possible touches at which the board was in place; `None` without any.
    #[must_use]
    pub fn in_place_of_possible(&self) -> Option<f64> {
        share(self.possible_in_place, self.possible)
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Without a touch there is no value, and NaN would look like one.
fn at(sorted: &[f64], p: f64) -> Option<f64> {
    (!sorted.is_empty()).then(|| quantile(sorted, p))
}

fn share(part: usize, all: usize) -> Option<f64> {
    (all > 0).then(|| part as f64 / all as f64)
}
