//! The board's aim while it is not touched.

use super::config::WatchdogConfig;
use super::hold::HoldReason;
use super::step::RenderInput;
use crate::board::BoardTarget;

/// Is there an aim, and is it recent?
pub(super) fn aimed_at(
    now_s: f64,
    input: &RenderInput<'_>,
    watchdog: &WatchdogConfig,
    knows_surfaces: bool,
) -> Result<(), HoldReason> {
    let stamp_s = match (input.target, input.posture) {
        (Some(target), _) => target.stamp_s,
        (None, Some(posture)) => posture.stamp_s,
        (None, None) => return Err(HoldReason::NoTarget),
    };
    if !knows_surfaces {
        return Err(HoldReason::UnknownSurfaces);
    }
    let age_s = now_s - stamp_s;
    let is_place = |target: &BoardTarget| {
        target.point_m.is_finite() && target.normal.try_normalize().is_some()
    };
    if !age_s.is_finite() || !input.target.is_none_or(is_place) {
        return Err(HoldReason::InvalidTarget);
    }
    if age_s.abs() > watchdog.max_target_age_s {
        return Err(HoldReason::StaleTarget { age_s });
    }
    Ok(())
}
