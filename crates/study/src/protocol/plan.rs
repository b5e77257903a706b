//! The plan of every subject: practice, blocks, catch trials, breaks.

use super::settings::Protocol;
use crate::error::StudyError;
use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// Purpose of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrialKind {
    /// Practice; does not count.
    Practice,
    /// A trial of the study.
    Main,
    /// Repeats the condition of the previous trial, to measure the agreement of answers; does not count.
    Catch,
}

/// One trial of a subject.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedTrial {
    /// Its number in the subject's plan, from 1.
    pub number: usize,
    /// Block, from 1; 0 for practice.
    pub block: usize,
    /// Its purpose.
    pub kind: TrialKind,
    /// Combination of levels, from 0, the last factor fastest.
    pub condition: usize,
    /// With two intervals: does the condition come second?
    pub second: bool,
}

/// A step of a subject's plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Planned {
    /// A trial.
    Trial(PlannedTrial),
    /// A rest, until the subject goes on.
    Break,
}

/// Random generator of one subject, independent of the study's other random numbers.
fn generator(seed: u64, subject: usize) -> Pcg64 {
    let step = (subject as u64 + 1).wrapping_mul(0xd134_2543_de82_ef95);
    Pcg64::seed_from_u64(seed.rotate_left(17) ^ step)
}

impl Protocol {
    /// The steps of a subject, counted from 0, in order.
    ///
    /// A plan depends only on the protocol and the number of the subject.
    ///
    /// # Errors
    /// As [`Protocol::validate`]; a subject beyond the study has an empty plan.
    pub fn plan(&self, subject: usize) -> Result<Vec<Planned>, StudyError> {
        self.validate()?;
        let own = self.schedule().trials_of(subject)?;
        let mut numbers = generator(self.seed, subject);
        let mut trials: Vec<(usize, TrialKind, usize)> = Vec::new();
        if subject < self.subjects {
            for _ in 0..self.practice {
                let condition = numbers.random_range(0..self.conditions());
                trials.push((0, TrialKind::Practice, condition));
            }
        }
        for block in own.chunk_by(|a, b| a.round == b.round) {
            // Positions in the block that get a catch trial.
            let mut places: Vec<usize> = (0..block.len()).collect();
            places.shuffle(&mut numbers);
            places.truncate(self.catch_per_block);
            for (place, trial) in block.iter().enumerate() {
                trials.push((trial.round + 1, TrialKind::Main, trial.condition));
                if places.contains(&place) {
                    trials.push((trial.round + 1, TrialKind::Catch, trial.condition));
                }
            }
        }
        let mut steps = Vec::with_capacity(trials.len());
        let count = trials.len();
        for (i, (block, kind, condition)) in trials.into_iter().enumerate() {
            steps.push(Planned::Trial(PlannedTrial {
                number: i + 1,
                block,
                kind,
                condition,
                second: coin(&mut numbers),
            }));
            let done = i + 1;
            if self.break_after > 0 && done % self.break_after == 0 && done < count {
                steps.push(Planned::Break);
            }
        }
        Ok(steps)
    }
}

fn coin(numbers: &mut impl Rng) -> bool {
    numbers.random_bool(0.5)
}
