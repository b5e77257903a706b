//! Who takes part in a study.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Who takes part. Fixed for a study from its first line on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Participants {
    /// People.
    #[default]
    People,
    /// Simulated participants.
    Simulated {
        /// Present every condition only once and reuse its rendering for all its trials?
        once_per_condition: bool,
    },
}

impl fmt::Display for Participants {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::People => "people",
            Self::Simulated {
                once_per_condition: false,
            } => "simulated participants",
            Self::Simulated {
                once_per_condition: true,
            } => "simulated participants and each condition presented once",
        })
    }
}
