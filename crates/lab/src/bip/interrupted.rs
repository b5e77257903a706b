//! Motions that stop on the way, suddenly or by and by, or that a filter joins late: how far the intervals of a bank can be trusted.

use crate::bip::scores::INTERVALS;
use crate::bip::setup::{Setup, TrainedModel};
use crate::bip::trajectories::{Trajectory, TrajectorySet};
use crate::report::{cells, named};
use anyhow::Context;
use hwall_bip::{
    Bank, BankConfig, Demonstration, EndPrediction, EvaluationConfig, Model, TrainingConfig, follow,
};
use hwall_testkit::{MarkdownTable, Sampler};

/// Where a motion stops or is joined, as a share of its samples.
const PLACES: [f64; 3] = [0.25, 0.4, 0.6];
/// Samples of a stop, and of each of its ramps where it comes by and by.
const RESTS: usize = 25;
const RAMP: f64 = 8.0;
/// Slowest on a ramp, as a share of the speed of the motion.
const CREEPS: f64 = 0.1;
/// The hand at rest trembles under the tracker by this standard deviation: that of the workload, m.
const TREMBLES_M: f64 = 1.5e-3;
/// Moments that are judged: samples after the interruption, then shares of what is left.
const SAMPLES_AFTER: [usize; 2] = [5, 10];
const SHARES_LEFT: [f64; 2] = [0.25, 0.5];
/// Half the width of a 90 % interval, standard deviations.
const INTERVAL_90: f64 = INTERVALS[1].half_width_sd;

named! {
    /// What happens on the way.
    enum Interruption {
        None = "none",
        Sudden = "sudden stop",
        Gradual = "gradual stop",
        JoinedLate = "joined there",
    }
}

impl Interruption {
    /// The places of a motion of so many samples that are seen, in samples of it, and the first one that counts as after it.
    fn places(self, samples: usize, at: usize) -> (Vec<f64>, usize) {
        let last = (samples - 1) as f64;
        let all = || (0..samples).map(|k| k as f64);
        match self {
            Self::None => (all().collect(), at),
            Self::JoinedLate => (all().skip(at).collect(), 0),
            Self::Sudden | Self::Gradual => {
                let stop = at as f64;
                let (mut place, mut rested, mut resumed) = (0.0, 0, 0.0);
                let mut places = Vec::new();
                let mut after = 0;
                while place < last {
                    places.push(place);
                    let gradual = self == Self::Gradual;
                    place += match place >= stop && rested < RESTS {
                        true => {
                            rested += 1;
                            after = places.len();
                            0.0
                        }
                        false if !gradual => 1.0,
                        false if rested == 0 => ((stop - place) / RAMP).clamp(CREEPS, 1.0),
                        false => {
                            resumed += 1.0;
                            (resumed / RAMP).clamp(CREEPS, 1.0)
                        }
                    };
                }
                places.push(last);
                (places, after)
            }
        }
    }
}

/// Each motion of a set is left out once and followed by a bank of the others, with an interruption at each of three places.
///
/// # Errors
/// Motions that cannot be learnt from; a filter that fails.
pub fn table(
    setup: &Setup,
    trained: &TrainedModel,
    set: &TrajectorySet,
    palm: &[usize],
) -> anyhow::Result<MarkdownTable> {
    let samples = SAMPLES_AFTER.map(|k| format!("{k} samples after"));
    let shares = SHARES_LEFT.map(|share| format!("{:.0} % of the rest seen", 100.0 * share));
    let moments = samples.into_iter().chain(shares);
    let mut table = MarkdownTable::new(cells(["interruption", "at"], moments));
    let banks = banks(setup, trained, set)?;
    let observed = &trained.observed;
    let palm: Vec<usize> = (0..observed.len())
        .filter(|&i| palm.contains(&observed[i]))
        .collect();
    for interruption in Interruption::ALL {
        for place in PLACES {
            let mut found = [const { Vec::new() }; SAMPLES_AFTER.len() + SHARES_LEFT.len()];
            let mut sampler = Sampler::new(7);
            for (trajectory, bank) in set.trajectories.iter().zip(&banks) {
                let foreseen =
                    interruption.foreseen(place, trajectory, observed, bank, &mut sampler);
                let foreseen = foreseen.with_context(|| trajectory.name.clone())?;
                for (found, foreseen) in found.iter_mut().zip(foreseen) {
                    found.extend(foreseen);
                }
            }
            let at = format!("{:.0} %", 100.0 * place);
            let own = found.map(|found| cell(&found, &palm));
            table.row(cells([interruption.name(), &at], own));
        }
    }
    Ok(table)
}

/// Mean distance of the palm, and the shares of the ends and of the times that their intervals hold.
fn cell(found: &[EndPrediction], palm: &[usize]) -> String {
    let held = |z: f64| z.abs() <= INTERVAL_90;
    let off_m: f64 = found.iter().map(|p| p.distance(palm)).sum();
    let ends: Vec<f64> = found
        .iter()
        .flat_map(|p| (0..p.mean.len()).map(|i| p.z(i)))
        .collect();
    let ends_held = ends.iter().filter(|z| held(**z)).count();
    let times_held = found.iter().filter(|p| p.time.is_some_and(|t| held(t.z())));
    let motions = found.len().max(1) as f64;
    format!(
        "{:.0} mm, {:.0} %, {:.0} %",
        1e3 * off_m / motions,
        100.0 * ends_held as f64 / ends.len().max(1) as f64,
        100.0 * times_held.count() as f64 / motions
    )
}

/// A bank for each motion, of all others, with the noise and the tuning of all: one number each, in which one motion hardly counts.
fn banks(setup: &Setup, trained: &TrainedModel, set: &TrajectorySet) -> anyhow::Result<Vec<Bank>> {
    let demonstrations = set.to_demonstrations()?;
    let config = TrainingConfig::new(trained.model.groups().to_vec());
    let bank = BankConfig {
        filter: setup.filter(),
        ..BankConfig::default()
    };
    let without = |out: usize| {
        let mut others = demonstrations.clone();
        others.remove(out);
        let mut model = Model::train(&others, &config)?;
        if let Some(tuning) = trained.model.tuning() {
            model = model.with_tuning(tuning)?;
        }
        Ok(Bank::new(&model, &bank)?)
    };
    (0..demonstrations.len()).map(without).collect()
}

impl Interruption {
    /// What a bank foresees of a motion that is interrupted at a place; `None` at moments after its end.
    fn foreseen(
        self,
        place: f64,
        trajectory: &Trajectory,
        observed: &[usize],
        bank: &Bank,
        sampler: &mut Sampler,
    ) -> anyhow::Result<Vec<Option<EndPrediction>>> {
        let rows = &trajectory.rows;
        let (last, dofs) = (rows.len() - 1, rows[0].len());
        let (places, after) = self.places(rows.len(), (place * rows.len() as f64) as usize);
        let trembles_m = match self {
            Self::Sudden | Self::Gradual => TREMBLES_M,
            Self::None | Self::JoinedLate => 0.0,
        };
        let value = |k: usize, dof: usize| rows[k.min(last)][dof].context("a missing value");
        let mut values = Vec::with_capacity(places.len() * dofs);
        for &place in &places {
            let before = place as usize;
            for dof in 0..dofs {
                let (a, b) = (value(before, dof)?, value(before + 1, dof)?);
                let trembles = observed.contains(&dof);
                let off = if trembles { sampler.normal() } else { 0.0 };
                values.push(a + (place - before as f64) * (b - a) + trembles_m * off);
            }
        }
        let motion = Demonstration::from_samples(1.0, dofs, values)?;
        let count = places.len();
        let left = SHARES_LEFT.map(|share| (share * (count - 1 - after) as f64) as usize);
        let due = SAMPLES_AFTER.into_iter().chain(left);
        let due: Vec<f64> = due.map(|k| (after + k + 1) as f64 / count as f64).collect();
        let mut fractions = due.clone();
        fractions.retain(|fraction| *fraction <= 1.0);
        fractions.sort_by(f64::total_cmp);
        fractions.dedup();
        let config = EvaluationConfig {
            fractions,
            observed: observed.to_vec(),
            scored: observed.to_vec(),
        };
        let mut found = follow(&mut bank.clone(), 0, &motion, &config)?;
        // Where it ends without trembling.
        let end: Vec<f64> = observed
            .iter()
            .map(|&dof| value(last, dof))
            .collect::<anyhow::Result<_>>()?;
        for prediction in &mut found {
            prediction.actual.clone_from(&end);
        }
        let at = |due: &f64| found.iter().find(|p| p.fraction == *due).cloned();
        Ok(due.iter().map(at).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interrupted_motions_end_where_they_would_have_ended() {
        for interruption in Interruption::ALL {
            for at in [20, 60] {
                let (places, after) = interruption.places(100, at);
                assert_eq!(places.last(), Some(&99.0), "{interruption:?}");
                assert!(
                    places
                        .windows(2)
                        .all(|w| w[0] <= w[1] && w[1] - w[0] <= 1.0)
                );
                let still = places.windows(2).filter(|w| w[0] == w[1]).count();
                let rests = match interruption {
                    Interruption::Sudden | Interruption::Gradual => RESTS,
                    Interruption::None | Interruption::JoinedLate => 0,
                };
                assert_eq!(still, rests, "{interruption:?}");
                assert!((places[after] - at as f64).abs() < 1.5);
            }
        }
    }
}
