//! What a session says of its board.

use hwall_haptics::{HoldReason, SafeState};

/// What the board is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SessionState {
    /// Standing still because an input is missing or wrong.
    Holding(HoldReason),
    /// At its waiting posture, or on the way there: nothing is about to be touched.
    Waiting,
    /// Behind the surface that is looked at, or on the way there.
    GettingReady,
    /// On its way to the goal.
    Approaching,
    /// The board cannot be at its goal before the hand, or the hand was expected there by now: it stays behind the surface,
    /// creeps, or stands because no way leads there behind the surfaces.
    Late,
    /// A person is where the board would have to be: it stays behind them.
    Obstructed,
    /// At the goal.
    InPlace,
    /// Touched: it stands still, or slides within its plane, whatever else happens.
    Touched,
    /// Touched while the virtual world moves around the arm: it stands still where it is until it is released.
    TouchedInMovingWorld,
    /// The supervisor has taken over: the board stands, withdraws, or gives way. Not for a fault that the renderer has named and
    /// for which the arm stands: that is [`SessionState::Holding`].
    Safe(SafeState),
}
