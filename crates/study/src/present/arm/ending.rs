//! Why a touch or the whole loop ended, in words for the log.

use hwall::haptics::{HoldReason, SafeReason, SafeState};
use hwall::{Control, SessionState};

/// As `stopped: not_obeyed`.
pub(super) fn of_safe(state: &SafeState) -> String {
    match state.reason() {
        Some(reason) => format!("{}: {}", state.name(), reason.name()),
        None => state.name().to_owned(),
    }
}

/// As `holding: stale_state`.
pub(super) fn of_hold(reason: HoldReason) -> String {
    format!("holding: {}", reason.name())
}

/// What a session did at last.
pub(super) fn of_session(state: SessionState) -> String {
    match state {
        SessionState::Holding(reason) => of_hold(reason),
        SessionState::Safe(state) => of_safe(&state),
        SessionState::Touched | SessionState::TouchedInMovingWorld => "touched".to_owned(),
        _ => "moving".to_owned(),
    }
}

/// Does the supervisor do something else than the session wants?
pub(super) const fn takes_over(state: &SafeState) -> bool {
    !matches!(state, SafeState::Normal | SafeState::Slowed { .. })
}

/// Did a person stop the arm? Then a person lets it go, and the study goes on.
pub(super) fn is_stopped_by_person(control: &Control) -> bool {
    control.is_latched() && control.safety().reason() == Some(SafeReason::Requested)
}
