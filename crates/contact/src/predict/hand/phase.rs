//! How far a hand is with its reach.

/// How far a hand is with its reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReachPhase {
    /// No reach is under way.
    Rest,
    /// No reach is seen yet, but the hand has come 1 cm since it was last slow.
    Stirring,
    /// A reach seems to have begun; the hand has come less than 8 cm.
    Onset,
    /// The reach is under way.
    UnderWay,
    /// Less than 0.3 s are left until the contact.
    End,
}

/// How many phases there are.
pub(in crate::predict) const PHASES: usize = 5;

impl ReachPhase {
    /// All of them, in order.
    pub const ALL: [Self; PHASES] = [
        Self::Rest,
        Self::Stirring,
        Self::Onset,
        Self::UnderWay,
        Self::End,
    ];

    /// The way up to which a reach is at its onset, m.
    const ONSET_M: f64 = 0.08;
    /// The time before contact from which it is at its end, s.
    const END_S: f64 = 0.3;
    /// The phase of a reach after a way, m, with some time left, s.
    pub(in crate::predict) fn of(way_m: f64, left_s: Option<f64>) -> Self {
        if way_m < Self::ONSET_M {
            Self::Onset
        } else if left_s.is_some_and(|left_s| left_s < Self::END_S) {
            Self::End
        } else {
            Self::UnderWay
        }
    }
}
