//! The phases of a touch in which a fault begins.

use crate::report::named;

named! {
    /// A phase of a touch.
    pub enum Phase {
        /// The arm is in its waiting posture.
        Waiting = "waiting",
        /// The board is on its way.
        Approaching = "approaching",
        /// The board stands where the hand will come.
        InPlace = "in place",
        /// The hand presses a wall.
        TouchedWall = "touched wall",
        /// The hand pushes a door open.
        TouchedDoor = "touched door, opening",
        /// The board slides under the hand to feel rough.
        Sliding = "sliding texture",
        /// The hand has just let go.
        Released = "released",
    }
}

impl Phase {
    /// Does the hand press the board?
    pub const fn is_touched(self) -> bool {
        matches!(self, Self::TouchedWall | Self::TouchedDoor | Self::Sliding)
    }

    /// Does the board move?
    pub const fn moves(self) -> bool {
        matches!(self, Self::Approaching | Self::TouchedDoor | Self::Sliding)
    }
}
