//! The content and the time of a controller message.

use crate::codec::{MonitorMessage, SessionState};
use crate::limits::SERVO_ERROR_RAD;
use std::time::Duration;

/// The newest message of the controller.
#[derive(Debug, Clone, Copy)]
pub(super) struct Newest {
    pub(super) message: MonitorMessage,
    pub(super) q_rad: [f64; 7],
    /// Time on the controller's clock, ns.
    pub(super) time_ns: u64,
    /// Arrival on the transport's clock.
    pub(super) arrived: Duration,
}

impl Newest {
    /// Where the controller holds an arm that this client has not commanded yet, rad: at its interpolator's positions or, once commanding is active,
    /// where another client has left it.
    pub(super) fn held_rad(&self) -> [f64; 7] {
        let data = self.message.data.unwrap_or_default();
        let is_active = self.message.connection.state == SessionState::CommandingActive;
        let commanded = data.commanded_position_rad.filter(|_| is_active);
        let interpolator = self.message.interpolator.and_then(|i| i.position_rad);
        let is_there = |held: &[f64; 7]| {
            let mut off_rad = held.iter().zip(&self.q_rad).map(|(a, b)| (a - b).abs());
            !is_active || off_rad.all(|off_rad| off_rad <= SERVO_ERROR_RAD)
        };
        let held = commanded.or(interpolator);
        held.filter(is_there).unwrap_or(self.q_rad)
    }
}

/// Longest accepted send period, ms: it limits the steps.
const LONGEST_PERIOD_MS: u32 = 100;

/// Time between messages of the controller, ms.
fn period_ms(message: &MonitorMessage) -> u32 {
    let said = message.connection.send_period_ms.unwrap_or(1);
    said.clamp(1, LONGEST_PERIOD_MS)
}

/// Share by which message times follow the controller's stamps. Stamps with 5 ms of jitter shift a message by 0.025 ms.
const FOLLOWS_STAMPS: f64 = 0.005;
/// Largest correction, as a share of a period: it bounds the velocity error.
const MOST_FOLLOWED: f64 = 0.02;
/// If a stamp is ahead by more than this, the controller has paused: its clock is adopted, ns.
const STOOD_STILL_NS: f64 = 5e8;

/// If the stamps contradict the period by more than [`MOST_FOLLOWED`], the time runs ahead by [`STOOD_STILL_NS`] within this, ns.
const RUNS_AHEAD_NS: u64 = (STOOD_STILL_NS / MOST_FOLLOWED) as u64;

/// By how much the stamps were set back behind the message time, ns; `None` for offsets that are followed.
pub(super) fn set_back(stamp_ns: i128, time_ns: u64) -> Option<i128> {
    let behind_ns = i128::from(time_ns) - stamp_ns;
    (behind_ns as f64 > STOOD_STILL_NS).then_some(behind_ns)
}

/// When the stamps were set back. A single time may be a clock adjustment; a repetition so soon means that the stated period is too long.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RanAhead {
    last_ns: Option<u64>,
    again_ns: Option<u64>,
}

impl RanAhead {
    pub(super) fn note(&mut self, time_ns: u64) {
        let is_soon = |last_ns| time_ns.saturating_sub(last_ns) < RUNS_AHEAD_NS;
        self.again_ns = self
            .last_ns
            .filter(|last_ns| is_soon(*last_ns))
            .map(|_| time_ns);
        self.last_ns = Some(time_ns);
    }

    /// Is the stated period known to be wrong?
    pub(super) fn is_wrong(&self, time_ns: u64) -> bool {
        let is_soon = |again_ns| time_ns.saturating_sub(again_ns) < RUNS_AHEAD_NS;
        self.again_ns.is_some_and(is_soon)
    }
}

/// Time of a message `ahead` after the last one, ns. A controller sends once per period, so messages count time; its stamps correct that slowly,
/// because they may jitter. Without a stated period only the stamps count.
pub(super) fn time_of_message(
    last_ns: u64,
    ahead: u32,
    message: &MonitorMessage,
    stamp_ns: Option<i128>,
) -> u64 {
    let dt_ns = f64::from(ahead) * f64::from(period_ms(message)) * 1e6;
    let by_period_ns = last_ns.saturating_add(dt_ns as u64);
    let Some(stamp_ns) = stamp_ns else {
        return by_period_ns;
    };
    let off_ns = (stamp_ns - i128::from(by_period_ns)) as f64;
    let no_period = message.connection.send_period_ms.is_none();
    // After a clock was set back its stamps are ignored.
    if off_ns < -STOOD_STILL_NS {
        return by_period_ns;
    }
    if no_period || off_ns > STOOD_STILL_NS {
        return u64::try_from(stamp_ns).map_or(by_period_ns, |stamp_ns| stamp_ns.max(last_ns));
    }
    let most_ns = MOST_FOLLOWED * dt_ns;
    by_period_ns.saturating_add_signed((FOLLOWS_STAMPS * off_ns).clamp(-most_ns, most_ns) as i64)
}

/// Longest accepted time between answers, s.
const LONGEST_ANSWER_PERIOD_S: f64 = 0.1;

/// Time between answered messages, s: it limits the motion of one command.
pub(super) fn answer_period_s(message: &MonitorMessage) -> f64 {
    let multiplier = message.connection.receive_multiplier.unwrap_or(1).max(1);
    let period_s = f64::from(period_ms(message)) * 1e-3 * f64::from(multiplier);
    period_s.min(LONGEST_ANSWER_PERIOD_S)
}

/// Are all used values finite?
pub(super) fn is_finite(message: &MonitorMessage) -> bool {
    let data = message.data.unwrap_or_default();
    let used = [
        data.position_rad,
        data.commanded_position_rad,
        data.external_torque_n_m,
        message.interpolator.and_then(|i| i.position_rad),
    ];
    used.iter().flatten().flatten().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::time_of_message;
    use crate::codec::{ConnectionInfo, ConnectionQuality, Header, MonitorMessage, SessionState};

    #[test]
    fn messages_count_time_and_stamps_only_lead_it() {
        let message = MonitorMessage {
            header: Header::default(),
            robot: None,
            data: None,
            connection: ConnectionInfo {
                state: SessionState::CommandingActive,
                quality: ConnectionQuality::Good,
                send_period_ms: Some(5),
                receive_multiplier: None,
            },
            interpolator: None,
        };
        let at = |stamp_ns| time_of_message(1_000_000_000, 1, &message, stamp_ns);
        assert_eq!(at(None), 1_005_000_000);
        assert_eq!(at(Some(1_005_000_000)), 1_005_000_000);
        // 4 ms of jitter, a clock set back by a minute, a controller that paused for two seconds.
        assert_eq!(at(Some(1_009_000_000)), 1_005_020_000);
        assert_eq!(at(Some(-59_000_000_000)), 1_005_000_000);
        assert_eq!(at(Some(3_000_000_000)), 3_000_000_000);
    }
}
