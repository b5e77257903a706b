//! The state of a study, from its events.

use super::adaptive::Adaptive;
use super::record::{StudyRecord, TrialRecord};
use crate::error::StudyError;
use crate::log::Event;
use crate::present::{Presentation, Stimulus};
use crate::protocol::{ArmKind, Participants, Planned, PlannedTrial, Protocol, TrialKind};
use std::collections::{BTreeMap, VecDeque};

/// The next step of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NextStep {
    /// Present a trial.
    Present {
        /// Subject, from 0.
        subject: usize,
        /// The trial.
        trial: PlannedTrial,
        /// Attempt, from 1.
        attempt: u32,
    },
    /// The presented trial needs an answer.
    Answer {
        /// Subject, from 0.
        subject: usize,
        /// The trial.
        trial: PlannedTrial,
    },
    /// A break, until the subject continues.
    Rest {
        /// Subject, from 0.
        subject: usize,
    },
    /// Nothing is left.
    Done,
}

/// State derived from the events so far.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    pub(super) protocol: Protocol,
    pub(super) records: Vec<TrialRecord>,
    /// Number of events so far, including the first.
    pub(super) events: usize,
    breaks: usize,
    resumptions: usize,
    subject: usize,
    queue: VecDeque<Planned>,
    shown: Option<Presentation>,
    /// Failed attempts, by number of this subject's remaining trials.
    failed: BTreeMap<usize, u32>,
    /// The adaptive procedure of this subject, if any.
    adaptive: Option<Adaptive>,
}

/// Start of the next subject.
#[derive(Debug)]
pub(super) struct NextSubject {
    subject: usize,
    rule: Option<Adaptive>,
    queue: VecDeque<Planned>,
}

/// The state change of an event.
#[derive(Debug)]
pub(super) enum Taken {
    Resumed,
    Shown(Presentation),
    Answered {
        record: Box<TrialRecord>,
        rule: Option<Adaptive>,
        again: bool,
        next: Option<NextSubject>,
    },
    Rested {
        next: Option<NextSubject>,
    },
}

impl Progress {
    pub(super) fn new(protocol: Protocol) -> Result<Self, StudyError> {
        let queue = protocol.plan(0)?.into();
        Ok(Self {
            adaptive: Adaptive::of(&protocol)?,
            protocol,
            records: Vec::new(),
            events: 1,
            breaks: 0,
            resumptions: 0,
            subject: 0,
            queue,
            shown: None,
            failed: BTreeMap::new(),
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

    /// The trial with its adaptive condition; a catch trial gets the condition of the trial before it.
    fn placed(&self, trial: &PlannedTrial) -> PlannedTrial {
        let Some(rule) = &self.adaptive else {
            return *trial;
        };
        let condition = match trial.kind {
            TrialKind::Practice => trial.condition,
            TrialKind::Main => rule.condition(),
            TrialKind::Catch => {
                let own = self.records.iter().rev();
                let mut own = own.take_while(|r| r.subject == self.subject);
                let before = own.find(|r| r.trial.number + 1 == trial.number);
                before.map_or(trial.condition, |r| r.trial.condition)
            }
        };
        PlannedTrial {
            condition,
            ..*trial
        }
    }

    fn attempt(&self, trial: &PlannedTrial) -> u32 {
        1 + self.failed.get(&trial.number).copied().unwrap_or_default()
    }

    /// The state change of an event; an error if the event does not follow from the previous ones.
    pub(super) fn prepare(&self, event: &Event) -> Result<Taken, StudyError> {
        self.taken(event).map_err(|why| StudyError::OutOfOrder {
            event: self.events + 1,
            why,
        })
    }

    fn taken(&self, event: &Event) -> Result<Taken, &'static str> {
        match (event, self.next()) {
            (Event::Resumed { .. }, _) => Ok(Taken::Resumed),
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
            ) if *subject == who && *trial == what.number => Ok(Taken::Shown(*shown)),
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
                let checked = answer.map(|value| self.protocol.procedure.check(value));
                let answer = checked.transpose();
                let answer = answer.map_err(|_| "an answer that its procedure does not accept")?;
                let wanted = Stimulus::of(&self.protocol, what.condition);
                let wanted = wanted.map_err(|_| "a condition that cannot be presented")?;
                let shown = self.shown.ok_or("an answer before the presentation")?;
                let record = TrialRecord {
                    subject: who,
                    trial: what,
                    attempt: self.attempt(&what),
                    wanted,
                    shown,
                    answer,
                    answered_s: *answered_s,
                    why_not: why_not.clone(),
                };
                let rule = self.adaptive.clone();
                let rule = rule.map(|rule| rule.after(std::iter::once(&record)));
                let rule = rule.transpose();
                let rule = rule.map_err(|_| "an answer that its rule cannot take")?;
                let again = !record.is_valid() && record.attempt < self.protocol.most_attempts;
                Ok(Taken::Answered {
                    next: match again {
                        true => None,
                        false => self.after_last_step()?,
                    },
                    record: Box::new(record),
                    rule,
                    again,
                })
            }
            (Event::Rested { subject }, NextStep::Rest { subject: who }) if *subject == who => {
                let next = self.after_last_step()?;
                Ok(Taken::Rested { next })
            }
            (Event::Opened { .. }, _) => Err("a second beginning"),
            (_, NextStep::Done) => Err("the study is over"),
            _ => Err("another step was due"),
        }
    }

    /// Applies a state change.
    pub(super) fn commit(&mut self, taken: Taken) {
        self.events += 1;
        let next = match taken {
            // The program had ended: an unanswered presentation is repeated.
            Taken::Resumed => {
                self.shown = None;
                self.resumptions += 1;
                None
            }
            Taken::Shown(shown) => {
                self.shown = Some(shown);
                None
            }
            Taken::Answered {
                record,
                rule,
                again,
                next,
            } => {
                self.shown = None;
                self.queue.pop_front();
                if again {
                    self.try_again(record.trial);
                }
                self.adaptive = rule;
                self.records.push(*record);
                next
            }
            Taken::Rested { next } => {
                self.queue.pop_front();
                self.breaks += 1;
                next
            }
        };
        if let Some(next) = next {
            self.subject = next.subject;
            self.failed.clear();
            self.adaptive = next.rule;
            self.queue = next.queue;
        }
    }

    /// Repeats a failed trial at the end of its block.
    fn try_again(&mut self, trial: PlannedTrial) {
        *self.failed.entry(trial.number).or_default() += 1;
        let of_block = |step: &Planned| matches!(step, Planned::Trial(t) if t.block == trial.block);
        let last = self.queue.iter().rposition(of_block);
        let place = last.map_or(0, |place| place + 1);
        self.queue.insert(place, Planned::Trial(trial));
    }

    /// The next subject, if the current step is the last one of its subject.
    fn after_last_step(&self) -> Result<Option<NextSubject>, &'static str> {
        let subject = self.subject + 1;
        if self.queue.len() > 1 || subject >= self.protocol.subjects {
            return Ok(None);
        }
        let rule = Adaptive::of(&self.protocol);
        let plan = self.protocol.plan(subject);
        Ok(Some(NextSubject {
            subject,
            rule: rule.map_err(|_| "a protocol without a rule")?,
            queue: plan.map_err(|_| "a subject without a plan")?.into(),
        }))
    }

    /// As a record.
    pub(super) fn into_record(self, participants: Participants, arm: ArmKind) -> StudyRecord {
        StudyRecord {
            done: self.next() == NextStep::Done,
            protocol: self.protocol,
            participants,
            arm,
            trials: self.records,
            breaks: self.breaks,
            resumptions: self.resumptions,
        }
    }

    /// Remaining planned trials, without possible repetitions.
    pub(super) fn left(&self) -> usize {
        let p = &self.protocol;
        let each =
            p.practice + p.repeats * (p.conditions() + p.catch_per_block.min(p.conditions()));
        let trials = self.queue.iter();
        let trials = trials.filter(|step| matches!(step, Planned::Trial(_)));
        trials.count() + (p.subjects - 1 - self.subject) * each
    }
}
