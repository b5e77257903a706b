//! What the board is doing, as one of a few words.

use hwall::SessionState;

/// What the board is doing, see [`SessionState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u8)]
pub enum ViewState {
    /// At its waiting posture, or on the way there.
    #[default]
    Waiting = 0,
    /// Behind the surface that is looked at, or on the way there.
    GettingReady = 1,
    /// On its way to the goal.
    Approaching = 2,
    /// At the goal.
    InPlace = 3,
    /// Touched.
    Touched = 4,
    /// Not in time for the hand.
    Late = 5,
    /// A person is where the board would have to be.
    Obstructed = 6,
    /// Standing still because an input is missing or wrong.
    Holding = 7,
    /// The supervisor has taken over.
    Safe = 8,
}

impl ViewState {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Waiting,
        Self::GettingReady,
        Self::Approaching,
        Self::InPlace,
        Self::Touched,
        Self::Late,
        Self::Obstructed,
        Self::Holding,
        Self::Safe,
    ];

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::GettingReady => "getting ready",
            Self::Approaching => "approaching",
            Self::InPlace => "in place",
            Self::Touched => "touched",
            Self::Late => "late",
            Self::Obstructed => "obstructed",
            Self::Holding => "holding",
            Self::Safe => "safe",
        }
    }

    /// Colour of the board's face in it, red green blue; told apart by colour-blind readers, too (after Okabe and Ito 2008).
    #[must_use]
    pub const fn rgb(self) -> [u8; 3] {
        match self {
            Self::Waiting => [150, 156, 165],
            Self::GettingReady => [86, 180, 233],
            Self::Approaching => [0, 114, 178],
            Self::InPlace => [0, 158, 115],
            Self::Touched => [240, 228, 66],
            Self::Late => [213, 94, 0],
            Self::Obstructed => [204, 121, 167],
            Self::Holding => [120, 94, 60],
            Self::Safe => [196, 40, 60],
        }
    }

    pub(crate) fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

impl From<SessionState> for ViewState {
    fn from(state: SessionState) -> Self {
        match state {
            SessionState::Waiting => Self::Waiting,
            SessionState::GettingReady => Self::GettingReady,
            SessionState::Approaching => Self::Approaching,
            SessionState::Late => Self::Late,
            SessionState::Obstructed => Self::Obstructed,
            SessionState::InPlace => Self::InPlace,
            SessionState::Touched | SessionState::TouchedInMovingWorld => Self::Touched,
            SessionState::Safe(_) => Self::Safe,
            // Also any state to come: nothing is claimed of a board that is not understood.
            _ => Self::Holding,
        }
    }
}
