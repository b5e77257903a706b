//! The phase of a reach.

/// The phase of a reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReachPhase {
    /// No reach is under way.
    Rest,
    /// No reach is detected yet, but the hand has moved 1 cm since it was last slow.
    Drifting,
    /// A reach seems to have begun; the hand has moved less than 8 cm.
    Onset,
    /// The reach is under way.
    UnderWay,
    /// Less than 0.3 s are left until contact.
    End,
}

pub(in crate::predict) const PHASES: usize = 5;

impl ReachPhase {
    /// All of them, in order.
    pub const ALL: [Self; PHASES] = [
        Self::Rest,
        Self::Drifting,
        Self::Onset,
        Self::UnderWay,
        Self::End,
    ];

    /// Distance up to which a reach is at its onset, m.
    const ONSET_M: f64 = 0.08;
    /// Time before contact at which the end begins, s.
    const END_S: f64 = 0.3;
    /// The phase of a reach after a distance, m, with some time left, s.
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
