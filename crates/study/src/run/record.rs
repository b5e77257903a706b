//! The record of a study.

use crate::present::{Presentation, Stimulus};
use crate::protocol::{ArmKind, Participants, PlannedTrial, Procedure, Protocol};

/// One trial that was presented and answered, or failed.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialRecord {
    /// Subject, from 0.
    pub subject: usize,
    /// Trial of the subject's plan.
    pub trial: PlannedTrial,
    /// Attempt, from 1.
    pub attempt: u32,
    /// What was wanted.
    pub wanted: Stimulus,
    /// What was rendered.
    pub shown: Presentation,
    /// The answer; none for a trial that failed.
    pub answer: Option<f64>,
    /// From the end of the touch to the answer, s.
    pub answered_s: f64,
    /// Why the trial is invalid; none for a valid one.
    pub why_not: Option<String>,
}

impl TrialRecord {
    /// Is it valid?
    #[must_use]
    pub const fn is_valid(&self) -> bool {
        self.answer.is_some() && self.why_not.is_none()
    }

    /// With two intervals: was the condition judged rougher than the reference? `None` without a valid answer.
    #[must_use]
    pub fn judged_rougher(&self) -> Option<bool> {
        let first = self.answer.filter(|_| self.is_valid())? == 1.0;
        Some(first != self.trial.second)
    }

    /// On a scale: the answer; with two touches, oriented so that high values favour the condition. `None` without a valid answer.
    #[must_use]
    pub fn rating(&self, procedure: Procedure) -> Option<f64> {
        let answer = self.answer.filter(|_| self.is_valid())?;
        match procedure {
            Procedure::MoreReal { points } if !self.trial.second => {
                Some(f64::from(points) + 1.0 - answer)
            }
            _ => Some(answer),
        }
    }
}

/// A study, as recorded in its log.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRecord {
    /// The protocol.
    pub protocol: Protocol,
    /// Who takes part.
    pub participants: Participants,
    /// Which kind of arm presents the trials.
    pub arm: ArmKind,
    /// All attempts so far, in order.
    pub trials: Vec<TrialRecord>,
    /// Breaks taken by all subjects.
    pub breaks: usize,
    /// How often the study was resumed.
    pub resumptions: usize,
    /// Is nothing left to do?
    pub done: bool,
}
