//! The phases of a touch in which a fault begins.

/// A phase of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Phase {
    /// The arm is in its waiting posture.
    Waiting,
    /// The board is on its way.
    Approaching,
    /// The board stands where the hand will come.
    InPlace,
    /// The hand presses a wall.
    TouchedWall,
    /// The hand pushes a door open.
    TouchedDoor,
    /// The board slides under the hand to feel rough.
    Sliding,
    /// The hand has just let go.
    Released,
}

impl Phase {
    /// In the order of a touch.
    pub const ALL: [Self; 7] = [
        Self::Waiting,
        Self::Approaching,
        Self::InPlace,
        Self::TouchedWall,
        Self::TouchedDoor,
        Self::Sliding,
        Self::Released,
    ];

    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Approaching => "approaching",
            Self::InPlace => "in place",
            Self::TouchedWall => "touched wall",
            Self::TouchedDoor => "touched door, opening",
            Self::Sliding => "sliding texture",
            Self::Released => "released",
        }
    }

    /// Does the hand press the board?
    #[must_use]
    pub const fn is_touched(self) -> bool {
        matches!(self, Self::TouchedWall | Self::TouchedDoor | Self::Sliding)
    }

    /// Does the board move?
    #[must_use]
    pub const fn moves(self) -> bool {
        matches!(self, Self::Approaching | Self::TouchedDoor | Self::Sliding)
    }
}
