//! What the board is doing, as one of a few names.

use hwall::SessionState;

/// What the board is doing, see [`SessionState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u8)]
pub enum ViewState {
    /// At its waiting posture, or on the way there.
    #[default]
    Waiting = 0,
    /// At a target behind the surface, or on the way there.
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

/// All states by number, with their names and the RGB colour of the board's face. The colours are safe for colour-blind readers (after
/// Okabe and Ito 2008).
const STATES: [(ViewState, &str, [u8; 3]); 9] = [
    (ViewState::Waiting, "waiting", [150, 156, 165]),
    (ViewState::GettingReady, "getting ready", [86, 180, 233]),
    (ViewState::Approaching, "approaching", [0, 114, 178]),
    (ViewState::InPlace, "in place", [0, 158, 115]),
    (ViewState::Touched, "touched", [240, 228, 66]),
    (ViewState::Late, "late", [213, 94, 0]),
    (ViewState::Obstructed, "obstructed", [204, 121, 167]),
    (ViewState::Holding, "holding", [120, 94, 60]),
    (ViewState::Safe, "safe", [196, 40, 60]),
];

impl ViewState {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 9] = {
        let mut all = [Self::Waiting; 9];
        let mut i = 0;
        while i < all.len() {
            all[i] = STATES[i].0;
            i += 1;
        }
        all
    };

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        STATES[self as usize].1
    }

    /// Colour of the board's face, red green blue.
    #[must_use]
    pub const fn rgb(self) -> [u8; 3] {
        STATES[self as usize].2
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
            // Also any future state: nothing is claimed about an unknown state.
            _ => Self::Holding,
        }
    }
}
