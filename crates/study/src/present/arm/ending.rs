//! Text for the log: why a touch or the whole loop ended.

use hwall::haptics::{HoldReason, SafeReason, SafeState};
use hwall::{Control, SessionState};

/// For instance `stopped: not_obeyed`.
pub(super) fn of_safe(state: &SafeState) -> String {
    match state.reason() {
        Some(reason) => format!("{}: {}", state.name(), reason.name()),
        None => state.name().to_owned(),
    }
}

/// For instance `holding: stale_state`.
pub(super) fn of_hold(reason: HoldReason) -> String {
    format!("holding: {}", reason.name())
}

/// Final state of a session.
pub(super) fn of_session(state: SessionState) -> String {
    match state {
        SessionState::Holding(reason) => of_hold(reason),
        SessionState::Safe(state) => of_safe(&state),
        SessionState::Touched | SessionState::TouchedInMovingWorld => "touched".to_owned(),
        _ => "moving".to_owned(),
    }
}

/// Does the supervisor override the session?
pub(super) const fn takes_over(state: &SafeState) -> bool {
    !matches!(state, SafeState::Normal | SafeState::Slowed { .. })
}

/// Did a person stop the arm? Then a person can reset it, and the study continues.
pub(super) fn is_stopped_by_person(control: &Control) -> bool {
    control.is_latched() && control.safety().reason() == Some(SafeReason::Requested)
}
