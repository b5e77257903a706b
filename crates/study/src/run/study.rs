//! A study and its log.

use super::progress::{NextStep, Progress};
use super::record::{StudyRecord, TrialRecord};
use crate::error::StudyError;
use crate::log::{Durability, Event, EventLog};
use crate::present::{Presentation, Stimulus, round};
use crate::protocol::{ArmKind, Participants, Protocol};
use std::path::{Path, PathBuf};

/// Version of the log.
const VERSION: u32 = 2;
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

/// A study in a folder. Every step is logged before the next one is returned, so a study that ended at any moment
/// resumes with its unfinished step.
#[derive(Debug)]
pub struct Study {
    log: EventLog,
    progress: Progress,
    participants: Participants,
    arm: ArmKind,
}

impl Study {
    /// Creates a study and its folder. Overwrites the truncated first line of an earlier study.
    ///
    /// # Errors
    /// A protocol that cannot be run or presented; a folder that holds a study ([`StudyError::Exists`]) or something else
    /// ([`StudyError::NotEmpty`], [`StudyError::NotALog`]), or cannot be written.
    pub fn create(
        folder: &Path,
        protocol: Protocol,
        participants: Participants,
        durability: Durability,
    ) -> Result<Self, StudyError> {
        Self::create_on(
            ArmKind::Simulated,
            folder,
            protocol,
            participants,
            durability,
        )
    }

    /// As [`Study::create`], for this kind of arm.
    ///
    /// # Errors
    /// As [`Study::create`].
    pub fn create_on(
        arm: ArmKind,
        folder: &Path,
        protocol: Protocol,
        participants: Participants,
        durability: Durability,
    ) -> Result<Self, StudyError> {
        protocol.validate()?;
        Stimulus::check_all(&protocol)?;
        let made = new_folders(folder);
        std::fs::create_dir_all(folder).map_err(|error| StudyError::io(folder, &error))?;
        let path = Self::log_path(folder);
        let name = folder.display().to_string();
        if !path.exists() && holds_anything(folder)? {
            return Err(StudyError::NotEmpty { name });
        }
        let progress = Progress::new(protocol.clone())?;
        let mut log = EventLog::create(&path, durability).map_err(|error| match error {
            StudyError::Exists { .. } => StudyError::Exists { name },
            other => other,
        })?;
        log.append(&Event::Opened {
            version: VERSION,
            protocol,
            participants,
            arm,
        })?;
        if durability == Durability::Disk {
            sync_names(folder, &made)?;
        }
        Ok(Self {
            log,
            progress,
            participants,
            arm,
        })
    }

    /// Resumes the study of a folder. A trial that was presented but not answered is presented again.
    ///
    /// # Errors
    /// No study in the folder; [`StudyError::NothingRecorded`] if it was truncated in its first line (a new study may be created
    /// there); [`StudyError::InUse`]; a changed log.
    pub fn resume(folder: &Path, durability: Durability) -> Result<Self, StudyError> {
        let (log, recovered) = EventLog::open(&Self::log_path(folder), durability)?;
        let (progress, participants, arm) = replay(&recovered.events)?;
        let mut study = Self {
            log,
            progress,
            participants,
            arm,
        };
        let dropped_bytes = recovered.dropped_bytes;
        study.take(Event::Resumed { dropped_bytes })?;
        Ok(study)
    }

    /// Reads the study of a folder without writing; another run may be using it.
    ///
    /// # Errors
    /// As [`Study::resume`], except [`StudyError::InUse`].
    pub fn read(folder: &Path) -> Result<StudyRecord, StudyError> {
        let events = EventLog::events(&Self::log_path(folder))?;
        Self::record_of(&events)
    }

    /// The study of a log's events.
    ///
    /// # Errors
    /// Events in an impossible order.
    pub fn record_of(events: &[Event]) -> Result<StudyRecord, StudyError> {
        let (progress, participants, arm) = replay(events)?;
        Ok(progress.into_record(participants, arm))
    }

    /// The study so far.
    #[must_use]
    pub fn record(&self) -> StudyRecord {
        self.progress
            .clone()
            .into_record(self.participants, self.arm)
    }

    /// Who takes part.
    #[must_use]
    pub const fn participants(&self) -> Participants {
        self.participants
    }

    /// Which kind of arm presents its trials.
    #[must_use]
    pub const fn arm(&self) -> ArmKind {
        self.arm
    }

    /// Refuses a kind of arm other than the study's.
    pub(super) fn expect_arm(&self, asked: ArmKind) -> Result<(), StudyError> {
        let stored = self.arm;
        if stored == asked {
            return Ok(());
        }
        Err(StudyError::OtherArm { stored, asked })
    }

    /// Refuses participants other than the study's.
    pub(super) fn expect(&self, asked: Participants) -> Result<(), StudyError> {
        if self.participants == asked {
            return Ok(());
        }
        Err(StudyError::OtherParticipants {
            stored: self.participants,
            asked,
        })
    }

    /// Path of the log in a folder.
    #[must_use]
    pub fn log_path(folder: &Path) -> PathBuf {
        folder.join(LOG)
    }

    /// The protocol.
    #[must_use]
    pub const fn protocol(&self) -> &Protocol {
        &self.progress.protocol
    }

    /// All attempts so far, in order.
    #[must_use]
    pub fn trials(&self) -> &[TrialRecord] {
        &self.progress.records
    }

    /// Remaining trials, if none fails.
    #[must_use]
    pub fn left(&self) -> usize {
        self.progress.left()
    }

    /// The next step; unchanged until it is done.
    #[must_use]
    pub fn next_step(&self) -> NextStep {
        self.progress.next()
    }

    /// The presentation that waits for an answer.
    #[must_use]
    pub const fn shown(&self) -> Option<&Presentation> {
        self.progress.shown()
    }

    /// Records a presented trial. A spoilt trial is recorded as such and repeated at the end of its block.
    ///
    /// # Errors
    /// No trial was to be presented; a number that is not finite or impossible; a log that cannot be written.
    pub fn presented(&mut self, shown: &Presentation) -> Result<(), StudyError> {
        self.presented_because(shown, None)
    }

    /// As [`Study::presented`], with details of why a trial was spoilt.
    ///
    /// # Errors
    /// As [`Study::presented`].
    pub fn presented_because(
        &mut self,
        shown: &Presentation,
        because: Option<&str>,
    ) -> Result<(), StudyError> {
        let NextStep::Present { subject, trial, .. } = self.next_step() else {
            return Err(StudyError::NoTrial {
                what: "a presentation",
            });
        };
        shown.validate()?;
        // Use exactly the stored values.
        let shown = shown.rounded();
        self.take(Event::Presented {
            subject,
            trial: trial.number,
            shown,
        })?;
        if let Some(why_not) = shown.why_not() {
            return self.spoilt(because.unwrap_or(why_not));
        }
        Ok(())
    }

    /// Records the answer to the presented trial.
    ///
    /// # Errors
    /// An answer that the procedure does not accept; nothing was presented; a log that cannot be written.
    pub fn answered(&mut self, answer: Answer) -> Result<(), StudyError> {
        let value = self.protocol().procedure.check(answer.value)?;
        let seconds = answer.answered_s;
        let holds = (0.0..=1e6).contains(&seconds);
        hwall::numeric::check::that(holds, "answered_s", seconds, "0 to 1e6")?;
        self.answer(Some(value), round(seconds), None)
    }

    /// Marks the presented trial as invalid, for a reason of the experimenter.
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
        self.take(Event::Answered {
            subject,
            trial: trial.number,
            answer,
            answered_s,
            why_not,
        })
    }

    /// Records the end of a break.
    ///
    /// # Errors
    /// There is no break; a log that cannot be written.
    pub fn rested(&mut self) -> Result<(), StudyError> {
        let NextStep::Rest { subject } = self.next_step() else {
            return Err(StudyError::NoTrial {
                what: "the end of a break",
            });
        };
        self.take(Event::Rested { subject })
    }

    /// Checks an event against the previous ones, logs it, then applies it.
    fn take(&mut self, event: Event) -> Result<(), StudyError> {
        let taken = self.progress.prepare(&event)?;
        self.log.append(&event)?;
        self.progress.commit(taken);
        Ok(())
    }
}

fn replay(events: &[Event]) -> Result<(Progress, Participants, ArmKind), StudyError> {
    let Some(Event::Opened {
        version,
        protocol,
        participants,
        arm,
    }) = events.first()
    else {
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
    for event in &events[1..] {
        let taken = progress.prepare(event)?;
        progress.commit(taken);
    }
    Ok((progress, *participants, *arm))
}

/// Does a folder contain anything except hidden files?
fn holds_anything(folder: &Path) -> Result<bool, StudyError> {
    let failed = |error: std::io::Error| StudyError::io(folder, &error);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name();
        if !name.to_string_lossy().starts_with('.') {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The folders of a path that do not exist yet, the innermost first.
fn new_folders(folder: &Path) -> Vec<PathBuf> {
    let missing = folder
        .ancestors()
        .take_while(|f| !f.as_os_str().is_empty() && !f.exists());
    missing.map(Path::to_owned).collect()
}

/// Syncs the names of a new log and new folders to disk: each name is stored in its parent folder.
fn sync_names(folder: &Path, made: &[PathBuf]) -> Result<(), StudyError> {
    let above = made.iter().filter_map(|f| f.parent());
    for folder in std::iter::once(folder).chain(above) {
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        // Other systems cannot open folders, and write names on their own.
        if cfg!(unix) {
            let synced = std::fs::File::open(folder).and_then(|f| f.sync_all());
            synced.map_err(|error| StudyError::io(folder, &error))?;
        }
    }
    Ok(())
}
