//! The inner torque loop: what becomes of a commanded torque.

use super::config::DriveConfig;

/// Torques that were commanded once in every control period, limited, delayed and smoothed.
///
/// The delay is `periods` whole control periods and a part of one, so that within a period the torque asked for changes
/// once. The lag is a first-order one and integrated exactly.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    most_n_m: [f64; 7],
    lag_s: f64,
    /// Part of a control period by which the delay exceeds a whole number of them, s.
    pub(super) change_s: f64,
    /// The newest torque is at `newest`, older ones follow.
    ring: Vec<[f64; 7]>,
    newest: usize,
    output: [f64; 7],
}

impl Drive {
    /// In rest at some torques.
    pub(super) fn new(
        config: &DriveConfig,
        most_n_m: [f64; 7],
        period_s: f64,
        rest: [f64; 7],
    ) -> Self {
        let mut periods = (config.torque_delay_s / period_s).floor();
        let mut change_s = config.torque_delay_s - periods * period_s;
        // 0.003 / 0.001 must not be two periods and all of a third one.
        if period_s - change_s < 1e-9 * period_s {
            periods += 1.0;
            change_s = 0.0;
        }
        if change_s < 1e-9 * period_s {
            change_s = 0.0;
        }
        let mut drive = Self {
            most_n_m,
            lag_s: config.torque_lag_s,
            change_s,
            ring: vec![rest; periods as usize + 2],
            newest: 0,
            output: rest,
        };
        let limited = drive.limited(&rest);
        drive.ring.fill(limited);
        drive.output = limited;
        drive
    }

    fn limited(&self, torques: &[f64; 7]) -> [f64; 7] {
        std::array::from_fn(|i| torques[i].clamp(-self.most_n_m[i], self.most_n_m[i]))
    }

    /// The torques commanded for the coming period.
    pub(super) fn command(&mut self, torques: &[f64; 7]) {
        let place = self.newest.checked_sub(1).unwrap_or(self.ring.len() - 1);
        self.ring[place] = self.limited(torques);
        self.newest = place;
    }

    /// What the loop aims at in the first part of the period, or after `change_s`.
    pub(super) fn aim(&self, after_change: bool) -> [f64; 7] {
        let delay = self.ring.len() - 2 + usize::from(!after_change);
        self.ring[(self.newest + delay) % self.ring.len()]
    }

    /// Moves on towards an aim; returns the mean torque on the way.
    pub(super) fn advance(&mut self, aim: &[f64; 7], dt_s: f64) -> [f64; 7] {
        if self.lag_s == 0.0 {
            self.output = *aim;
            return *aim;
        }
        let rate = dt_s / self.lag_s;
        let gone = -(-rate).exp_m1();
        let mean = gone / rate;
        std::array::from_fn(|i| {
            let off = self.output[i] - aim[i];
            self.output[i] = aim[i] + off * (1.0 - gone);
            aim[i] + off * mean
        })
    }

    /// Torques that the motors exert now, N m.
    pub(super) const fn output(&self) -> &[f64; 7] {
        &self.output
    }
}
