//! Reasons for a lost hand, as a value and as text.

use super::freeze::FreezeKind;
use std::fmt::{self, Display};

/// Reason for a lost hand.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LostReason {
    /// The stream has just started or resumed, and the hand has not been good for long enough.
    Starting,
    /// No point of the hand is seen.
    NoPoints,
    /// No sample arrived at all for this long, s.
    Gap {
        /// Time between the two samples, s.
        gap_s: f64,
    },
    /// The hand moved faster than plausible.
    Jump {
        /// Speed of the step, m/s.
        speed_m_per_s: f64,
    },
    /// The tracker repeats a pose.
    Frozen {
        /// Kind of freeze.
        kind: FreezeKind,
    },
    /// The sample has no usable time, or time ran backwards and the filter restarted.
    InvalidTime,
}

impl Display for LostReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Starting => f.write_str("not seen for long enough yet"),
            Self::NoPoints => f.write_str("no point of the hand is seen"),
            Self::Gap { gap_s } => write!(f, "no sample for {gap_s:.2} s"),
            Self::Jump { speed_m_per_s } => write!(f, "a jump at {speed_m_per_s:.0} m/s"),
            Self::Frozen { kind } => f.write_str(match kind {
                FreezeKind::Still => "the tracker repeats the same points",
                FreezeKind::Rigid => {
                    "the tracker moves one rigid shape and no longer sees the hand"
                }
            }),
            Self::InvalidTime => f.write_str("a sample without a usable time"),
        }
    }
}
