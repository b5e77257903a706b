//! What a session reports about its board.

use hwall_haptics::{HoldReason, SafeState};

/// What the board is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SessionState {
    /// Standing still because an input is missing or wrong.
    Holding(HoldReason),
    /// At its waiting posture, or on the way there: no touch is expected.
    Waiting,
    /// At a target behind the surface, or on the way there.
    GettingReady,
    /// On its way to the goal.
    Approaching,
    /// The board cannot be at its goal before the hand, or the hand is overdue. It stays behind the surface, creeps, or stands still
    /// because no path behind the surfaces leads there.
    Late,
    /// A person is where the board would have to be: it stays behind them.
    Obstructed,
    /// At the goal.
    InPlace,
    /// Touched: it stands still, or slides within its plane, whatever else happens.
    Touched,
    /// Touched while the virtual world moves around the arm: it stands still where it is until it is released.
    TouchedInMovingWorld,
    /// The supervisor has taken over: the board stands still, withdraws, or yields. If the renderer reported the fault and the arm stands
    /// still for it, the state is [`SessionState::Holding`].
    Safe(SafeState),
}
