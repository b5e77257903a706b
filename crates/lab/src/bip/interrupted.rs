//! Motions that stop on the way, suddenly or by and by, or that a filter joins late: how far the intervals of a bank can be trusted.

use crate::bip::scores::INTERVALS;
use crate::bip::setup::{Setup, TrainedModel};
use crate::bip::trajectories::{Trajectory, TrajectorySet};
use crate::report::{cells, named};
use anyhow::Context;
use hwall_bip::{Bank, BankConfig, Model, Observation, TrainingConfig};
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

/// What was foreseen at one moment.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    palm_m: f64,
    held: usize,
    values: usize,
    time_held: usize,
    motions: usize,
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
    for interruption in Interruption::ALL {
        for place in PLACES {
            let mut tallies = [Tally::default(); SAMPLES_AFTER.len() + SHARES_LEFT.len()];
            let mut sampler = Sampler::new(7);
            for (trajectory, bank) in set.trajectories.iter().zip(&banks) {
                let run = Run {
                    trajectory,
                    observed: &trained.observed,
                    palm,
                    interruption,
                    place,
                };
                run.follow(bank.clone(), &mut sampler, &mut tallies)
                    .with_context(|| trajectory.name.clone())?;
            }
            let own = tallies.map(|t| {
                let motions = t.motions.max(1) as f64;
                let held = t.held as f64 / t.values.max(1) as f64;
                format!(
                    "{:.0} mm, {:.0} %, {:.0} %",
                    1e3 * t.palm_m / motions,
                    100.0 * held,
                    100.0 * t.time_held as f64 / motions
                )
            });
            let at = format!("{:.0} %", 100.0 * place);
            table.row(cells([interruption.name(), &at], own));
        }
    }
    Ok(table)
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

/// One motion, seen with an interruption.
struct Run<'a> {
    trajectory: &'a Trajectory,
    observed: &'a [usize],
    palm: &'a [usize],
    interruption: Interruption,
    place: f64,
}

impl Run<'_> {
    fn follow(
        &self,
        mut bank: Bank,
        sampler: &mut Sampler,
        tallies: &mut [Tally],
    ) -> anyhow::Result<()> {
        let rows = &self.trajectory.rows;
        let at = (self.place * rows.len() as f64) as usize;
        let (places, after) = self.interruption.places(rows.len(), at);
        let count = places.len();
        let left = SHARES_LEFT.map(|share| (share * (count - 1 - after) as f64) as usize);
        let due: Vec<usize> = SAMPLES_AFTER.into_iter().chain(left).collect();
        let trembles_m = match self.interruption {
            Interruption::Sudden | Interruption::Gradual => TREMBLES_M,
            Interruption::None | Interruption::JoinedLate => 0.0,
        };
        let mut values = Vec::with_capacity(self.observed.len());
        for (k, place) in places.iter().enumerate() {
            values.clear();
            for dof in self.observed {
                let value = self.at(*place, *dof)?;
                values.push(value + trembles_m * sampler.normal());
            }
            bank.predict(1.0)?;
            bank.observe(&Observation::new(self.observed, &values))?;
            for (_, tally) in due
                .iter()
                .zip(&mut *tallies)
                .filter(|(due, _)| **due + after == k)
            {
                self.judge(&mut bank, (count - 1 - k) as f64, tally)?;
            }
        }
        Ok(())
    }

    /// A value between two samples.
    fn at(&self, place: f64, dof: usize) -> anyhow::Result<f64> {
        let rows = &self.trajectory.rows;
        let before = place as usize;
        let value = |k: usize| rows[k.min(rows.len() - 1)][dof].context("a missing value");
        let (a, b) = (value(before)?, value(before + 1)?);
        Ok(a + (place - before as f64) * (b - a))
    }

    fn judge(&self, bank: &mut Bank, left: f64, tally: &mut Tally) -> anyhow::Result<()> {
        let count = self.observed.len();
        let (mut mean, mut variance) = (vec![0.0; count], vec![0.0; count]);
        bank.predict_at(1.0, self.observed, &mut mean, &mut variance)?;
        let last = (self.trajectory.rows.len() - 1) as f64;
        let mut off = 0.0;
        for ((dof, mean), variance) in self.observed.iter().zip(&mean).zip(&variance) {
            let error = (mean - self.at(last, *dof)?).abs();
            tally.held += usize::from(error <= INTERVAL_90 * variance.sqrt());
            if self.palm.contains(dof) {
                off += error * error;
            }
        }
        tally.values += count;
        tally.palm_m += off.sqrt();
        tally.motions += 1;
        let held = bank
            .time_to_end()
            .is_some_and(|time| (time.mean - left).abs() <= INTERVAL_90 * time.sd);
        tally.time_held += usize::from(held);
        Ok(())
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
