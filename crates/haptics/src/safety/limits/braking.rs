//! Cuts a command so that the arm can follow it.

use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};

/// Time constant with which a cut command catches up with the wanted one, s.
const CATCHING_S: f64 = 0.05;
/// Share of the accelerations that catching up reserves for braking.
const CATCHING: f64 = 0.5;
/// A command counts as caught up if it lags by less than this share of a joint's acceleration times the squared cycle time.
const BEHIND: f64 = 0.01;

/// The last wanted and the last sent command: a cut slows the joints down no harder than allowed, and the lag is made up for in the same way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::safety) struct Braking {
    wanted: JointPositions,
    sent: JointPositions,
    rates: JointVelocities,
}

impl Braking {
    /// For an arm that has received no command: its configuration and velocity. The measured velocity may slightly exceed the command limits.
    pub(in crate::safety) fn from_state(
        q: &JointPositions,
        qd: &[f64; MOST_JOINTS],
        velocity_rad_per_s: &[f64; MOST_JOINTS],
    ) -> Self {
        Self {
            wanted: *q,
            sent: *q,
            rates: JointVelocities(std::array::from_fn(|i| {
                let most = velocity_rad_per_s[i];
                if qd[i].is_finite() {
                    qd[i].clamp(-most, most)
                } else {
                    0.0
                }
            })),
        }
    }

    /// Does the last sent command equal the wanted one?
    fn is_beside(&self, acceleration_rad_per_s2: &[f64; MOST_JOINTS], dt_s: f64) -> bool {
        (0..MOST_JOINTS).all(|i| {
            let least = BEHIND * acceleration_rad_per_s2[i] * dt_s * dt_s;
            (self.wanted[i] - self.sent[i]).abs() <= least
        })
    }

    /// Joint velocities needed now, rad/s: the wanted ones, and faster while the command lags. `dt_s` is positive.
    pub(in crate::safety) fn rates_rad_per_s(
        &self,
        wanted: &JointPositions,
        acceleration_rad_per_s2: &[f64; MOST_JOINTS],
        dt_s: f64,
    ) -> [f64; MOST_JOINTS] {
        if self.is_beside(acceleration_rad_per_s2, dt_s) {
            return std::array::from_fn(|i| (wanted[i] - self.sent[i]) / dt_s);
        }
        std::array::from_fn(|i| {
            let most = CATCHING * acceleration_rad_per_s2[i] * CATCHING_S;
            let missing = (self.wanted[i] - self.sent[i]) / CATCHING_S.max(dt_s);
            (wanted[i] - self.wanted[i]) / dt_s + missing.clamp(-most, most)
        })
    }

    /// The command for an allowed share of the velocities, within the joint accelerations. All joints change alike, so that the board stays on its
    /// path. Without a cut (`share` is `None`) and without a lag the wanted command passes unchanged.
    pub(in crate::safety) fn next(
        &self,
        wanted: &JointPositions,
        rates_rad_per_s: &[f64; MOST_JOINTS],
        share: Option<f64>,
        acceleration_rad_per_s2: &[f64; MOST_JOINTS],
        dt_s: f64,
    ) -> Self {
        if share.is_none() && self.is_beside(acceleration_rad_per_s2, dt_s) {
            return Self {
                wanted: *wanted,
                sent: *wanted,
                rates: JointVelocities(*rates_rad_per_s),
            };
        }
        let share = share.unwrap_or(1.0);
        let change: [f64; MOST_JOINTS] =
            std::array::from_fn(|i| share * rates_rad_per_s[i] - self.rates[i]);
        let part = (0..MOST_JOINTS)
            .filter(|i| change[*i] != 0.0)
            .map(|i| acceleration_rad_per_s2[i] * dt_s / change[i].abs())
            .fold(1.0, f64::min);
        let rate_rad_per_s: [f64; MOST_JOINTS] =
            std::array::from_fn(|i| self.rates[i] + part * change[i]);
        Self {
            wanted: *wanted,
            sent: JointPositions(std::array::from_fn(|i| {
                self.sent[i] + rate_rad_per_s[i] * dt_s
            })),
            rates: JointVelocities(rate_rad_per_s),
        }
    }

    /// The command sent.
    pub(in crate::safety) const fn sent(&self) -> &JointPositions {
        &self.sent
    }

    /// Its joint velocities.
    pub(in crate::safety) const fn rates(&self) -> &JointVelocities {
        &self.rates
    }

    /// The share of the given velocities that the joints move with, 0 to 1.
    pub(in crate::safety) fn share_of(&self, rates_rad_per_s: &[f64; MOST_JOINTS]) -> f64 {
        let dot = |a: &[f64; MOST_JOINTS]| -> f64 {
            a.iter().zip(rates_rad_per_s).map(|(a, b)| a * b).sum()
        };
        (dot(&self.rates.0) / dot(rates_rad_per_s).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// The same with another command sent, as required by an angle limit.
    pub(in crate::safety) fn sending(self, sent: JointPositions) -> Self {
        Self { sent, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 1e-3;
    const MOST: [f64; MOST_JOINTS] = [8.0, 5.0, 5.0, 10.0, 10.0, 12.0, 12.0];

    /// Joint velocities over one second at a share of a steady motion, and the lag at the end, rad.
    fn run(share: impl Fn(usize) -> f64) -> (Vec<[f64; MOST_JOINTS]>, f64) {
        let rate = [0.5, -0.4, 0.3, 0.9, 0.0, -1.0, 0.2];
        let start = JointPositions::default();
        let mut braking = Braking::from_state(&start, &rate, &[2.0; MOST_JOINTS]);
        let mut wanted = start;
        let mut rates = vec![rate];
        for k in 0..1000 {
            for (q, rate) in wanted.0.iter_mut().zip(rate) {
                *q += rate * DT_S;
            }
            let asked = braking.rates_rad_per_s(&wanted, &MOST, DT_S);
            let share = Some(share(k)).filter(|share| *share < 1.0);
            braking = braking.next(&wanted, &asked, share, &MOST, DT_S);
            rates.push(braking.rates.0);
        }
        (rates, wanted.max_abs_difference(braking.sent()))
    }

    #[test]
    fn cuts_and_what_makes_up_for_them_keep_to_the_accelerations() {
        for least in [0.0, 0.3, 0.9] {
            let (rates, behind_rad) = run(|k| if (100..200).contains(&k) { least } else { 1.0 });
            for pair in rates.windows(2) {
                for joint in 0..MOST_JOINTS {
                    let change = (pair[1][joint] - pair[0][joint]).abs() / DT_S;
                    assert!(change <= MOST[joint] * (1.0 + 1e-9), "{joint}: {change}");
                }
            }
            assert!(behind_rad < 1e-5, "{least}: {behind_rad} rad behind");
            // As hard as the joint that needs longest allows: joint 4 needs 90 ms. The share also applies to the lag.
            let slowed = rates[200][0] / rates[0][0];
            let bounds = least - 1e-9..1.5 * least + 1e-9;
            assert!(bounds.contains(&slowed), "{least}: {slowed}");
        }
    }

    #[test]
    fn what_nobody_cuts_is_sent_as_it_is() {
        let (rates, behind_rad) = run(|_| 1.0);
        assert_eq!(behind_rad, 0.0);
        assert!(rates.iter().all(|rates| (rates[0] - 0.5).abs() < 1e-9));
    }
}
