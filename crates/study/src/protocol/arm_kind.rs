//! Which kind of arm presents the trials of a study.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Which kind of arm presents the trials. Fixed for a study from its first line on, because kinds of arm render
/// differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArmKind {
    /// The simulated arm, with a simulated hand.
    #[default]
    Simulated,
    /// An arm behind KUKA's Fast Robot Interface, with the participant's tracked hand.
    Fri,
}

impl ArmKind {
    pub(crate) fn is_simulated(&self) -> bool {
        *self == Self::Simulated
    }
}

impl fmt::Display for ArmKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Simulated => "the simulated arm",
            Self::Fri => "an arm behind FRI",
        })
    }
}
