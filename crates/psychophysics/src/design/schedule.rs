//! The order of the conditions for each subject.

use super::latin::{check_conditions, row_count, square_row};
use super::random::generator;
use crate::error::{PsychophysicsError, Result};
use crate::study::Factor;
use hwall_numeric::check::that;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::io::Write;

/// Largest number of trials of a schedule.
const MOST_TRIALS: usize = 100_000_000;

/// Columns of every session script, before its factors.
const COLUMNS: [&str; 4] = ["subject", "round", "trial", "condition"];

/// How the conditions of a round are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum TrialOrder {
    /// Every round is a random order of all conditions; no condition occurs twice in a row, even across
    /// rounds.
    #[default]
    RandomisedBlocks,
    /// Rows of a balanced Latin square, one after the other over subjects and rounds.
    BalancedLatinSquare,
}

/// The plan of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// Factors, all within subjects; their combinations are the conditions.
    pub factors: Vec<Factor>,
    /// Subjects.
    pub subjects: usize,
    /// Repetitions of every condition for every subject.
    pub rounds: usize,
    /// Order within rounds.
    pub order: TrialOrder,
    /// Seed of random orders. A subject's order depends only on the seed and the subject's number.
    pub seed: u64,
}

/// One trial of a [`Schedule`]; all counts from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScheduledTrial {
    /// Subject.
    pub subject: usize,
    /// Round (repetition).
    pub round: usize,
    /// Position in the round.
    pub place: usize,
    /// Combination of levels, the last factor fastest.
    pub condition: usize,
}

impl Schedule {
    /// Number of conditions.
    #[must_use]
    pub fn conditions(&self) -> usize {
        Factor::combinations(&self.factors)
    }

    /// All trials: subject by subject, in order.
    ///
    /// # Errors
    /// No factor, level, subject or round; more than 1e8 trials; more than 2000 conditions in a Latin
    /// square; a factor with the name of another factor or of a column of the script.
    pub fn trials(&self) -> Result<Vec<ScheduledTrial>> {
        self.validate()?;
        let mut trials = Vec::with_capacity(self.subjects * self.rounds * self.conditions());
        for subject in 0..self.subjects {
            self.append_trials_of(subject, &mut trials);
        }
        Ok(trials)
    }

    /// The trials of one subject, in order; none for a subject beyond the schedule. The time does not depend on the number of subjects.
    ///
    /// # Errors
    /// As [`Schedule::trials`].
    pub fn trials_of(&self, subject: usize) -> Result<Vec<ScheduledTrial>> {
        self.validate()?;
        let mut trials = Vec::new();
        if subject < self.subjects {
            trials.reserve_exact(self.rounds * self.conditions());
            self.append_trials_of(subject, &mut trials);
        }
        Ok(trials)
    }

    /// Rejects a schedule that has no trials or too many.
    ///
    /// # Errors
    /// As [`Schedule::trials`].
    pub fn validate(&self) -> Result<()> {
        for (what, count) in [
            ("factors", self.factors.len()),
            ("conditions", self.conditions()),
            ("subjects", self.subjects),
            ("rounds", self.rounds),
        ] {
            let value = count as f64;
            that(count > 0, what, value, "at least 1")?;
        }
        for (place, factor) in self.factors.iter().enumerate() {
            let name = factor.name.trim();
            let taken = COLUMNS.iter().any(|c| c.eq_ignore_ascii_case(name));
            if taken || self.factors[..place].iter().any(|f| f.name.trim() == name) {
                let factor = factor.name.clone();
                return Err(PsychophysicsError::ColumnTaken { factor });
            }
        }
        let all = [self.rounds, self.conditions()];
        let all = all.into_iter().fold(self.subjects, usize::saturating_mul);
        that(all <= MOST_TRIALS, "trials", all as f64, "at most 1e8")?;
        if self.order == TrialOrder::BalancedLatinSquare {
            check_conditions(self.conditions())?;
        }
        Ok(())
    }

    fn append_trials_of(&self, subject: usize, trials: &mut Vec<ScheduledTrial>) {
        let conditions = self.conditions();
        let mut numbers = generator(self.seed, subject);
        let mut order: Vec<usize> = (0..conditions).collect();
        for round in 0..self.rounds {
            match self.order {
                TrialOrder::RandomisedBlocks => shuffle(&mut order, round > 0, &mut numbers),
                TrialOrder::BalancedLatinSquare => {
                    let row = (subject * self.rounds + round) % row_count(conditions);
                    order = square_row(conditions, row);
                }
            }
            let places = order.iter().enumerate();
            trials.extend(places.map(|(place, &condition)| ScheduledTrial {
                subject,
                round,
                place,
                condition,
            }));
        }
    }

    /// Level of every factor in a condition; `None` unless it is one of [`Schedule::conditions`].
    #[must_use]
    pub fn levels(&self, condition: usize) -> Option<Vec<&str>> {
        Factor::levels_at(&self.factors, condition)
    }

    /// The session script as CSV: `subject,round,trial,condition` from 1, then the factors.
    ///
    /// With a column of answers added, [`Study`](crate::study::Study) can read it.
    ///
    /// # Errors
    /// As [`Schedule::trials`]', and an output that cannot be written.
    pub fn write_csv(&self, output: impl Write) -> Result<()> {
        let trials = self.trials()?;
        let mut writer = csv::Writer::from_writer(output);
        let write = |writer: &mut csv::Writer<_>, row: Vec<String>| writer.write_record(row);
        let header = COLUMNS.map(str::to_owned);
        let names = self.factors.iter().map(|f| f.name.clone());
        write(&mut writer, header.into_iter().chain(names).collect()).map_err(not_written)?;
        for trial in &trials {
            let place = trial.round * self.conditions() + trial.place;
            let counts = [trial.subject, trial.round, place, trial.condition];
            let counts = counts.into_iter().map(|c| (c + 1).to_string());
            let levels = self.levels(trial.condition).into_iter().flatten();
            let levels = levels.map(str::to_owned);
            write(&mut writer, counts.chain(levels).collect()).map_err(not_written)?;
        }
        writer.flush().map_err(|error| not_written(error.into()))
    }
}

/// Shuffles; if `follows`, the first condition differs from the last of the previous order.
fn shuffle(order: &mut [usize], follows: bool, generator: &mut Pcg64) {
    let last = order.last().copied();
    order.shuffle(generator);
    while follows && order.len() > 1 && order.first().copied() == last {
        order.shuffle(generator);
    }
}

fn not_written(error: csv::Error) -> PsychophysicsError {
    PsychophysicsError::io("session script", &error.into())
}
