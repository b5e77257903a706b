//! A study and its log.

use super::progress::{NextStep, Progress, TrialRecord};
use crate::error::StudyError;
use crate::log::{Durability, Event, EventLog};
use crate::present::{Presentation, Stimulus, round};
use crate::protocol::Protocol;
use std::path::{Path, PathBuf};

/// Version of the log.
const VERSION: u32 = 1;
/// Name of the log in the folder of a study.
const LOG: &str = "study.log";

/// An answer to a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The number: a magnitude, a point of a scale, 1 or 2.
    pub value: f64,
    /// From the end of the touch to the answer, s.
    pub answered_s: f64,
}

/// A study in a folder. Every step is in its log before the next one is told, so that a study that ended at any
/// moment goes on with the step that it had not finished.
#[derive(Debug)]
pub struct Study {
    log: EventLog,
    progress: Progress,
}

impl Study {
    /// Begins a study in a folder, which is made.
    ///
    /// # Errors
    /// A protocol that cannot be run or presented; a folder that holds a study or cannot be written.
    pub fn create(
        folder: &Path,
        protocol: Protocol,
        durability: Durability,
    ) -> Result<Self, StudyError> {
        protocol.validate()?;
        for condition in 0..protocol.conditions() {
            Stimulus::of(&protocol, condition)?;
        }
        std::fs::create_dir_all(folder).map_err(|error| StudyError::io(folder, &error))?;
        let path = Self::log_path(folder);
        if path.exists() {
            return Err(StudyError::Exists {
                name: folder.display().to_string(),
            });
        }
        let progress = Progress::new(protocol.clone())?;
        let mut log = EventLog::create(&path, durability)?;
        log.append(&Event::Opened {
            version: VERSION,
            protocol,
        })?;
        Ok(Self { log, progress })
    }

    /// Goes on with the study of a folder where it stopped. A trial that was presented and not answered is presented again.
    ///
    /// # Errors
    /// No study there; a log that was changed.
    pub fn resume(folder: &Path, durability: Durability) -> Result<Self, StudyError> {
        let (mut log, recovered) = EventLog::open(&Self::log_path(folder), durability)?;
        let progress = replay(&recovered.events)?;
        let mut study = Self {
            progress,
            log: {
                log.append(&Event::Resumed {
                    dropped_bytes: recovered.dropped_bytes,
                })?;
                log
            },
        };
        study.progress.interrupted();
        Ok(study)
    }

    /// The study of a log, to look at; nothing is written.
    ///
    /// # Errors
    /// As [`Study::resume`].
    pub fn records(events: &[Event]) -> Result<(Protocol, Vec<TrialRecord>), StudyError> {
        let progress = replay(events)?;
        Ok((progress.protocol, progress.records))
    }

    /// Where the log of a folder is.
    #[must_use]
    pub fn log_path(folder: &Path) -> PathBuf {
        folder.join(LOG)
    }

    /// What it does.
    #[must_use]
    pub const fn protocol(&self) -> &Protocol {
        &self.progress.protocol
    }

    /// All attempts so far, in order.
    #[must_use]
    pub fn trials(&self) -> &[TrialRecord] {
        &self.progress.records
    }

    /// Trials that are left, if none fails.
    #[must_use]
    pub fn left(&self) -> usize {
        self.progress.left()
    }

    /// What comes next; the same until it is done.
    #[must_use]
    pub fn next_step(&self) -> NextStep {
        self.progress.next()
    }

    /// What was presented and waits for an answer.
    #[must_use]
    pub const fn shown(&self) -> Option<&Presentation> {
        self.progress.shown()
    }

    /// The trial was presented. One that is spoilt is recorded as such, and comes again at the end of its block.
    ///
    /// # Errors
    /// No trial was to be presented; a log that cannot be written.
    pub fn presented(&mut self, shown: &Presentation) -> Result<(), StudyError> {
        let NextStep::Present { subject, trial, .. } = self.next_step() else {
            return Err(StudyError::NoTrial {
                what: "a presentation",
            });
        };
        self.record(Event::Presented {
            subject,
            trial: trial.number,
            shown: *shown,
        })?;
        if let Some(why_not) = shown.why_not() {
            return self.spoilt(why_not);
        }
        Ok(())
    }

    /// The trial that was presented is answered.
    ///
    /// # Errors
    /// An answer that the procedure does not have; nothing was presented; a log that cannot be written.
    pub fn answered(&mut self, answer: Answer) -> Result<(), StudyError> {
        let value = self.protocol().procedure.check(answer.value)?;
        let seconds = answer.answered_s;
        let holds = (0.0..=1e6).contains(&seconds);
        hwall::numeric::check::that(holds, "answered_s", seconds, "0 to 1e6")?;
        self.answer(Some(value), round(seconds), None)
    }

    /// The trial that was presented does not count, for a reason of whoever runs the study.
    ///
    /// # Errors
    /// Nothing was presented; a log that cannot be written.
    pub fn spoilt(&mut self, why_not: &str) -> Result<(), StudyError> {
        self.answer(None, 0.0, Some(why_not.chars().take(200).collect()))
    }

    fn answer(
        &mut self,
        answer: Option<f64>,
        answered_s: f64,
        why_not: Option<String>,
    ) -> Result<(), StudyError> {
        let NextStep::Answer { subject, trial } = self.next_step() else {
            return Err(StudyError::NoTrial { what: "an answer" });
        };
        self.record(Event::Answered {
            subject,
            trial: trial.number,
            answer,
            answered_s,
            why_not,
        })
    }

    /// The break is over.
    ///
    /// # Errors
    /// There is none; a log that cannot be written.
    pub fn rested(&mut self) -> Result<(), StudyError> {
        let NextStep::Rest { subject } = self.next_step() else {
            return Err(StudyError::NoTrial {
                what: "the end of a break",
            });
        };
        self.record(Event::Rested { subject })
    }

    /// On the disk first, then in memory.
    fn record(&mut self, event: Event) -> Result<(), StudyError> {
        self.log.append(&event)?;
        let event_number = self.progress.records.len();
        self.progress
            .take(&event)
            .map_err(|why| StudyError::OutOfOrder {
                event: event_number,
                why,
            })
    }
}

fn replay(events: &[Event]) -> Result<Progress, StudyError> {
    let Some(Event::Opened { version, protocol }) = events.first() else {
        return Err(StudyError::NoStudy {
            why: "it does not begin with a protocol",
        });
    };
    if *version != VERSION {
        return Err(StudyError::NoStudy {
            why: "it is of another version",
        });
    }
    let mut progress = Progress::new(protocol.clone())?;
    for (number, event) in events.iter().enumerate().skip(1) {
        progress.take(event).map_err(|why| StudyError::OutOfOrder {
            event: number + 1,
            why,
        })?;
    }
    Ok(progress)
}
