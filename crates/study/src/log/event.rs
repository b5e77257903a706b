//! Events of the log.

use crate::present::Presentation;
use crate::protocol::{ArmKind, Participants, Protocol};
use serde::{Deserialize, Serialize};

/// An event of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case", deny_unknown_fields)]
pub enum Event {
    /// The first line: the study.
    Opened {
        /// Version of the log.
        version: u32,
        /// The study.
        protocol: Protocol,
        /// Who takes part; absent in logs of version 1, which means people.
        #[serde(default)]
        participants: Participants,
        /// Kind of arm; omitted for the simulated arm.
        #[serde(default, skip_serializing_if = "ArmKind::is_simulated")]
        arm: ArmKind,
    },
    /// The study continues after its program had ended.
    Resumed {
        /// Bytes of an incomplete line that was dropped.
        dropped_bytes: u64,
    },
    /// A trial was presented.
    Presented {
        /// Subject, from 0.
        subject: usize,
        /// Number of the trial in the subject's plan, from 1.
        trial: usize,
        /// What was rendered.
        shown: Presentation,
    },
    /// The trial was answered, or it failed.
    Answered {
        /// Subject, from 0.
        subject: usize,
        /// Number of the trial in the subject's plan, from 1.
        trial: usize,
        /// The answer; none for a trial that failed.
        answer: Option<f64>,
        /// From the end of the touch to the answer, s.
        answered_s: f64,
        /// Why the trial is invalid; none for a valid one.
        why_not: Option<String>,
    },
    /// A break ended.
    Rested {
        /// Subject, from 0.
        subject: usize,
    },
}

impl Event {
    /// Its kind, as one word.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Opened { .. } => "opened",
            Self::Resumed { .. } => "resumed",
            Self::Presented { .. } => "presented",
            Self::Answered { .. } => "answered",
            Self::Rested { .. } => "rested",
        }
    }
}
