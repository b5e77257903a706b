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

/// A study in a folder. Every step is in its log before the next one is told, so that a study that ended at any
/// moment goes on with the step that it had not finished.
#[derive(Debug)]
pub struct Study {
    log: EventLog,
    progress: Progress,
    participants: Participants,
    arm: ArmKind,
}

impl Study {
    /// Begins a study in a folder, which is made. What a cut left of the first line of an earlier study is overwritten.
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

    /// As [`Study::create`], for trials that this kind of arm presents.
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
        if !path.exists() && holds_anything(folder)? {
            return Err(StudyError::NotEmpty {
                name: folder.display().to_string(),
            });
        }
        let progress = Progress::new(protocol.clone())?;
        let name = folder.display().to_string();
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

    /// Goes on with the study of a folder where it stopped. A trial that was presented and not answered is presented again.
    ///
    /// # Errors
    /// No study there; [`StudyError::NothingRecorded`] where one was cut in its first line, so that a new one may be created
    /// there; [`StudyError::InUse`]; a log that was changed.
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

    /// The study of a folder as it stands, to look at; nothing is written, also while another run goes on with it.
    ///
    /// # Errors
    /// As [`Study::resume`], but for [`StudyError::InUse`].
    pub fn read(folder: &Path) -> Result<StudyRecord, StudyError> {
        let events = EventLog::events(&Self::log_path(folder))?;
        Self::record_of(&events)
    }

    /// The study of a log's events, to look at.
    ///
    /// # Errors
    /// Events that do not follow from each other.
    pub fn record_of(events: &[Event]) -> Result<StudyRecord, StudyError> {
        let (progress, participants, arm) = replay(events)?;
        Ok(progress.into_record(participants, arm))
    }

    /// The study as it stands.
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

    /// Refuses another kind of arm than that on which the study began.
    pub(super) fn expect_arm(&self, asked: ArmKind) -> Result<(), StudyError> {
        let stored = self.arm;
        if stored == asked {
            return Ok(());
        }
        Err(StudyError::OtherArm { stored, asked })
    }

    /// Refuses others than those with whom the study began.
    pub(super) fn expect(&self, asked: Participants) -> Result<(), StudyError> {
        if self.participants == asked {
            return Ok(());
        }
        Err(StudyError::OtherParticipants {
            stored: self.participants,
            asked,
        })
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
    /// No trial was to be presented; a number that is not finite or not possible; a log that cannot be written.
    pub fn presented(&mut self, shown: &Presentation) -> Result<(), StudyError> {
        self.presented_because(shown, None)
    }

    /// As [`Study::presented`], with more words about why a trial was spoilt.
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
        // What is stored is what is used.
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
        self.take(Event::Answered {
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
        self.take(Event::Rested { subject })
    }

    /// An event that follows from those before it goes to the disk, then into memory; another one goes nowhere.
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

/// Is there anything in a folder but hidden files?
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

/// Puts the names of a new log and of new folders on the disk: each name is in the folder above it.
fn sync_names(folder: &Path, made: &[PathBuf]) -> Result<(), StudyError> {
    let above = made.iter().filter_map(|f| f.parent());
    for folder in std::iter::once(folder).chain(above) {
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        // Other systems have no folders that can be opened, and write names by themselves.
        if cfg!(unix) {
            let synced = std::fs::File::open(folder).and_then(|f| f.sync_all());
            synced.map_err(|error| StudyError::io(folder, &error))?;
        }
    }
    Ok(())
}
