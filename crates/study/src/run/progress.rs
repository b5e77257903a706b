//! Where a study stands, as its events tell.

use super::adaptive::Adaptive;
use crate::error::StudyError;
use crate::log::Event;
use crate::present::{Presentation, Stimulus};
use crate::protocol::{Planned, PlannedTrial, Protocol, TrialKind};
use std::collections::VecDeque;

/// One trial that was presented and answered, or failed.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialRecord {
    /// Subject, from 0.
    pub subject: usize,
    /// Which trial of the subject's plan.
    pub trial: PlannedTrial,
    /// Which attempt at it, from 1.
    pub attempt: u32,
    /// What was wanted.
    pub wanted: Stimulus,
    /// What was rendered.
    pub shown: Presentation,
    /// The answer; none for a trial that failed.
    pub answer: Option<f64>,
    /// From the end of the touch to the answer, s.
    pub answered_s: f64,
    /// Why the trial does not count; none for one that does.
    pub why_not: Option<String>,
}

impl TrialRecord {
    /// Does it count?
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
}

/// What a study does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NextStep {
    /// A trial is to be presented to a subject, counted from 0, and this is the attempt at it, from 1.
    Present {
        /// Who.
        subject: usize,
        /// What.
        trial: PlannedTrial,
        /// Which attempt.
        attempt: u32,
    },
    /// The trial that was presented is to be answered.
    Answer {
        /// Who.
        subject: usize,
        /// What.
        trial: PlannedTrial,
    },
    /// The subject rests until it goes on.
    Rest {
        /// Who.
        subject: usize,
    },
    /// Nothing is left.
    Done,
}

/// Everything that follows from the events so far.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    pub(super) protocol: Protocol,
    pub(super) records: Vec<TrialRecord>,
    subject: usize,
    queue: VecDeque<Planned>,
    shown: Option<Presentation>,
    /// Attempts that failed, of the trials left of this subject.
    failed: Vec<(usize, u32)>,
    /// Where the answers of this subject place its trials.
    adaptive: Option<Adaptive>,
}

impl Progress {
    pub(super) fn new(protocol: Protocol) -> Result<Self, StudyError> {
        let queue = protocol.plan(0)?.into();
        Ok(Self {
            adaptive: Adaptive::of(&protocol)?,
            protocol,
            records: Vec::new(),
            subject: 0,
            queue,
            shown: None,
            failed: Vec::new(),
        })
    }

    pub(super) fn next(&self) -> NextStep {
        let subject = self.subject;
        match self.queue.front() {
            None => NextStep::Done,
            Some(Planned::Break) => NextStep::Rest { subject },
            Some(Planned::Trial(trial)) if self.shown.is_some() => NextStep::Answer {
                subject,
                trial: self.placed(trial),
            },
            Some(Planned::Trial(trial)) => NextStep::Present {
                subject,
                trial: self.placed(trial),
                attempt: self.attempt(trial),
            },
        }
    }

    pub(super) const fn shown(&self) -> Option<&Presentation> {
        self.shown.as_ref()
    }

    /// A trial with the condition that the answers so far give it.
    fn placed(&self, trial: &PlannedTrial) -> PlannedTrial {
        let placed = self
            .adaptive
            .as_ref()
            .filter(|_| trial.kind == TrialKind::Main);
        PlannedTrial {
            condition: placed.map_or(trial.condition, Adaptive::condition),
            ..*trial
        }
    }

    fn attempt(&self, trial: &PlannedTrial) -> u32 {
        let failed = self
            .failed
            .iter()
            .find(|(number, _)| *number == trial.number);
        1 + failed.map_or(0, |(_, count)| *count)
    }

    /// The program ended: what was presented and not answered is presented again.
    pub(super) fn interrupted(&mut self) {
        self.shown = None;
    }

    /// Does an event follow from those before it? Then why not, in the words of the log's error.
    pub(super) fn take(&mut self, event: &Event) -> Result<(), &'static str> {
        match (event, self.next()) {
            (Event::Resumed { .. }, _) => {
                self.interrupted();
                Ok(())
            }
            (
                Event::Presented {
                    subject,
                    trial,
                    shown,
                },
                NextStep::Present {
                    subject: who,
                    trial: what,
                    ..
                },
            ) if *subject == who && *trial == what.number => {
                self.shown = Some(*shown);
                Ok(())
            }
            (
                Event::Answered {
                    subject,
                    trial,
                    answer,
                    answered_s,
                    why_not,
                },
                NextStep::Answer {
                    subject: who,
                    trial: what,
                },
            ) if *subject == who && *trial == what.number => {
                let wanted = Stimulus::of(&self.protocol, what.condition);
                let wanted = wanted.map_err(|_| "a condition that cannot be presented")?;
                let shown = self
                    .shown
                    .take()
                    .ok_or("an answer before the presentation")?;
                let attempt = self.attempt(&what);
                let record = TrialRecord {
                    subject: who,
                    trial: what,
                    attempt,
                    wanted,
                    shown,
                    answer: *answer,
                    answered_s: *answered_s,
                    why_not: why_not.clone(),
                };
                if let Some(rule) = self.adaptive.take() {
                    let after = rule.after(std::iter::once(&record));
                    self.adaptive = Some(after.map_err(|_| "an answer that its rule cannot take")?);
                }
                let again = !record.is_valid() && attempt < self.protocol.most_attempts;
                self.records.push(record);
                self.queue.pop_front();
                if again {
                    self.try_again(what);
                }
                self.next_subject()
            }
            (Event::Rested { subject }, NextStep::Rest { subject: who }) if *subject == who => {
                self.queue.pop_front();
                self.next_subject()
            }
            (Event::Opened { .. }, _) => Err("a second beginning"),
            (_, NextStep::Done) => Err("the study is over"),
            _ => Err("another step was due"),
        }
    }

    /// A trial that failed comes again at the end of its block.
    fn try_again(&mut self, trial: PlannedTrial) {
        match self
            .failed
            .iter_mut()
            .find(|(number, _)| *number == trial.number)
        {
            Some((_, count)) => *count += 1,
            None => self.failed.push((trial.number, 1)),
        }
        let of_block = |step: &Planned| matches!(step, Planned::Trial(t) if t.block == trial.block);
        let last = self.queue.iter().rposition(of_block);
        let place = last.map_or(0, |place| place + 1);
        self.queue.insert(place, Planned::Trial(trial));
    }

    fn next_subject(&mut self) -> Result<(), &'static str> {
        while self.queue.is_empty() && self.subject + 1 < self.protocol.subjects {
            self.subject += 1;
            self.failed.clear();
            let rule = Adaptive::of(&self.protocol);
            self.adaptive = rule.map_err(|_| "a protocol without a rule")?;
            let plan = self.protocol.plan(self.subject);
            self.queue = plan.map_err(|_| "a subject without a plan")?.into();
        }
        Ok(())
    }

    /// Trials that are planned and not done, without those that may have to be repeated.
    pub(super) fn left(&self) -> usize {
        let trials = |steps: &VecDeque<Planned>| {
            steps
                .iter()
                .filter(|s| matches!(s, Planned::Trial(_)))
                .count()
        };
        let p = &self.protocol;
        let each =
            p.practice + p.repeats * (p.conditions() + p.catch_per_block.min(p.conditions()));
        trials(&self.queue) + (p.subjects - 1 - self.subject) * each
    }
}
