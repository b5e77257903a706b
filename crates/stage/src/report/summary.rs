//! Summary figures of a run.

use crate::run::evaluation::regret::Miss;
use crate::run::people::{JudgedTouch, PersonRun};
use glam::DVec3;
use hwall_testkit::quantile;
use serde::Serialize;
use std::collections::BTreeMap;

/// Above this face speed a first contact counts as an impact, m/s.
pub const FAST_M_PER_S: f64 = 0.1;

/// All touches of all people in a few numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// People who touched.
    pub people: usize,
    /// Their touches.
    pub touches: usize,
    /// Touches that the arm can reach.
    pub reachable: usize,
    /// Touches for which the board could have been in time.
    pub possible: usize,
    /// Touches within reach at which the board was there before the hand.
    pub in_place: usize,
    /// Possible touches with the board in place.
    #[serde(skip)]
    pub possible_in_place: usize,
    /// Distance of the face from the touched point along the normal, of the touches within reach, m; `None` without any.
    pub gap_median_m: Option<f64>,
    /// 90th percentile of the same distance, m.
    pub gap_p90_m: Option<f64>,
    /// Median time from the arrival of the hand until the touch was felt, of felt touches, s.
    pub felt_median_s: Option<f64>,
    /// Share of the touches meeting the board with a first contact faster than [`FAST_M_PER_S`].
    #[serde(skip)]
    pub met_fast: Option<f64>,
    /// The same for the speed along the normal of the face, which makes the impact.
    #[serde(skip)]
    pub met_fast_along_normal: Option<f64>,
    /// Median number of reversals of the board before a touch.
    pub reversals_median: Option<f64>,
    /// False dispatches per touch.
    pub in_vain_per_touch: Option<f64>,
    /// Those of them to the place of the touch, called back before it, per touch.
    #[serde(skip)]
    pub called_back_per_touch: Option<f64>,
    /// Touches without the board in place, by cause, in the order of [`Miss::ALL`].
    pub misses: [usize; Miss::ALL.len()],
    /// Number of these touches with a stop of the arm before them, by reason.
    pub stops: BTreeMap<String, usize>,
    /// Number of holds of the arm, and of latched ones that needed a reset by a person.
    pub holds: usize,
    /// See `holds`.
    pub latches: usize,
    /// Share of the control steps in which a link was in front of a surface within reach of the person.
    pub link_in_front: Option<f64>,
    /// Largest such distance, m.
    pub link_in_front_most_m: Option<f64>,
    /// 99th percentile of the time of a control step, us.
    pub step_p99_us: Option<f64>,
}

impl Summary {
    /// Summarises all touches of these runs.
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
        let gaps_m = Sorted::of(reachable.iter().map(|t| t.outcome.gap_m));
        let felt_s = Sorted::of(reachable.iter().filter_map(|t| t.outcome.felt_after_s));
        let met: Vec<DVec3> = touches
            .iter()
            .filter_map(|t| t.outcome.met_m_per_s)
            .collect();
        let fast = |speed: fn(&DVec3) -> f64| {
            let fast = met.iter().filter(|met| speed(met) > FAST_M_PER_S);
            share(fast.count(), met.len())
        };
        let reversals = Sorted::of(touches.iter().map(|t| t.regret.detours.reversals as f64));
        let in_vain: usize = touches.iter().map(|t| t.regret.detours.in_vain).sum();
        let called_back: usize = touches.iter().map(|t| t.regret.detours.called_back).sum();
        let mut stops = BTreeMap::new();
        for stop in touches.iter().filter_map(|t| t.regret.stopped_by) {
            *stops.entry(stop.to_string()).or_default() += 1;
        }
        let in_front = runs.iter().flat_map(|run| &run.run.links_in_front_m);
        let in_front = Sorted::of(in_front.copied());
        let step_ns = step_ns(runs);
        Self {
            people: runs.len(),
            touches: touches.len(),
            reachable: reachable.len(),
            possible: count(&|t| t.regret.possible),
            in_place: count(&|t| t.outcome.in_place()),
            possible_in_place: count(&|t| t.regret.possible && t.outcome.in_place()),
            gap_median_m: gaps_m.at(0.5),
            gap_p90_m: gaps_m.at(0.9),
            felt_median_s: felt_s.at(0.5),
            met_fast: fast(|met| met.length()),
            met_fast_along_normal: fast(|met| met.z.abs()),
            reversals_median: reversals.at(0.5),
            in_vain_per_touch: share(in_vain, touches.len()),
            called_back_per_touch: share(called_back, touches.len()),
            misses: Miss::ALL.map(|miss| {
                let missed = |t: &&&JudgedTouch| t.regret.miss == Some(miss);
                touches.iter().filter(missed).count()
            }),
            stops,
            holds: runs.iter().map(|run| run.run.holds).sum(),
            latches: runs.iter().map(|run| run.run.latches).sum(),
            link_in_front: share(in_front.len(), step_ns.len()),
            link_in_front_most_m: in_front.at(1.0),
            step_p99_us: step_ns.at(0.99).map(|ns| 1e-3 * ns),
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

fn share(part: usize, all: usize) -> Option<f64> {
    (all > 0).then(|| part as f64 / all as f64)
}

/// Sorted values.
pub(super) struct Sorted(Vec<f64>);

impl Sorted {
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    pub(super) const fn len(&self) -> usize {
        self.0.len()
    }

    /// The quantile; `None` without values.
    pub(super) fn at(&self, p: f64) -> Option<f64> {
        (!self.0.is_empty()).then(|| quantile(&self.0, p))
    }

    /// These quantiles as text with a unit: `12 / 34 ms`; `none` without values.
    pub(super) fn text(&self, p: &[f64], unit: &str, words: impl Fn(f64) -> String) -> String {
        let at: Option<Vec<String>> = p.iter().map(|p| self.at(*p).map(&words)).collect();
        at.map_or("none".to_owned(), |at| at.join(" / ") + unit)
    }
}

/// Times of all control steps, ns.
pub(super) fn step_ns(runs: &[PersonRun]) -> Sorted {
    let costs = runs.iter().flat_map(|run| &run.run.costs);
    Sorted::of(costs.map(|cost| f64::from(cost.step_ns)))
}
