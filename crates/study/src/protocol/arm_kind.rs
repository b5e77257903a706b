//! Which kind of arm presents the trials of a study.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Which kind of arm presents the trials. A study stays with one kind from its first line on: what one renders is not what another
/// does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArmKind {
    /// The simulated one, with a simulated hand.
    #[default]
    Simulated,
    /// One behind KUKA's Fast Robot Interface, with the tracked hand of whoever takes part.
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
