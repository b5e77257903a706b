//! The inner torque loop.

use super::config::DriveConfig;

/// Torques commanded once per control period, saturated, delayed and low-pass filtered.
///
/// The delay is `periods` whole control periods plus a fraction, so that the target torque changes once within a
/// period. The first-order lag is integrated exactly.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    most_n_m: [f64; 7],
    lag_s: f64,
    /// Remainder of the delay beyond whole control periods, s.
    pub(super) change_s: f64,
    /// The latest torque is at index `newest`; older ones follow.
    ring: Vec<[f64; 7]>,
    newest: usize,
    output: [f64; 7],
}

impl Drive {
    /// The loop in steady state at the given torques.
    pub(super) fn new(
        config: &DriveConfig,
        most_n_m: [f64; 7],
        period_s: f64,
        rest: [f64; 7],
    ) -> Self {
        let mut periods = (config.torque_delay_s / period_s).floor();
        let mut change_s = config.torque_delay_s - periods * period_s;
        // Rounding of 0.003 / 0.001 must not give two periods and a full remainder.
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

    /// Sets the torques commanded for the next period.
    pub(super) fn command(&mut self, torques: &[f64; 7]) {
        let place = self.newest.checked_sub(1).unwrap_or(self.ring.len() - 1);
        self.ring[place] = self.limited(torques);
        self.newest = place;
    }

    /// Target of the loop in the first part of the period, or after `change_s`.
    pub(super) fn aim(&self, after_change: bool) -> [f64; 7] {
        let delay = self.ring.len() - 2 + usize::from(!after_change);
        self.ring[(self.newest + delay) % self.ring.len()]
    }

    /// Advances towards a target; returns the mean torque over the step.
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

    /// Current motor torques, N m.
    pub(super) const fn output(&self) -> &[f64; 7] {
        &self.output
    }
}
