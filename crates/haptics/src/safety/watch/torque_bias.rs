//! Torque sensor bias, measured while nobody can touch the board.

use crate::arm::ArmState;
use crate::error::HapticsError;
use crate::low_pass;
use crate::safety::limits::motion_guard::GuardLimits;
use hwall_kinematics::{JointTorques, MOST_JOINTS};
use hwall_numeric::check::{non_negative, positive};

/// How the torque sensor bias is estimated, and how much of it is tolerated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasConfig {
    /// Largest tolerated bias, as a share of the joint's largest torque; default 0.1 (17.6 N m at the shoulder of an iiwa 7, 4 N m at its wrist). A
    /// larger bias hides a touch, or counts as one.
    pub most_share: f64,
    /// Joints slower than this are at rest, rad/s; default 0.02.
    pub rest_rad_per_s: f64,
    /// The arm must rest, and the board be out of reach, for this long, s; default 0.5.
    pub rest_s: f64,
    /// Time constant of the estimate, s; default 0.3.
    pub filter_s: f64,
    /// Least number of samples in the mean, from the last fifth of the rest on; default 50.
    pub least_samples: u32,
    /// A torque beyond the bias by more than this is a contact of the arm: any such torque while the board is out of reach, otherwise what pushes on
    /// its face do not explain. A share of each joint's largest torque; default 0.03 (5.3 N m at the shoulder of an iiwa 7, 1.2 N m at its wrist),
    /// above noise and model errors.
    pub contact_share: f64,
    /// Time constant of its low-pass filter, s; default 0.005.
    pub contact_filter_s: f64,
    /// After the first measurement the bias follows the sensors by at most `contact_share` in this time, s; default 300. Sensors drift as they
    /// warm up, in minutes. A person who pushes lightly, or who is squeezed slowly, must not become part of the bias. So `contact_share` must exceed
    /// the differences between the sensors' errors in all postures; if it does not, stop and reset the arm where it is told that something pushes it.
    pub drift_s: f64,
}

impl Default for BiasConfig {
    fn default() -> Self {
        Self {
            most_share: 0.1,
            rest_rad_per_s: 0.02,
            rest_s: 0.5,
            filter_s: 0.3,
            least_samples: 50,
            contact_share: 0.03,
            contact_filter_s: 0.005,
            drift_s: 300.0,
        }
    }
}

impl BiasConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("most_share", self.most_share)?;
        positive("rest_rad_per_s", self.rest_rad_per_s)?;
        non_negative("rest_s", self.rest_s)?;
        non_negative("filter_s", self.filter_s)?;
        positive("contact_share", self.contact_share)?;
        non_negative("contact_filter_s", self.contact_filter_s)?;
        positive("drift_s", self.drift_s)?;
        Ok(())
    }
}

/// Share of the rest after which samples count: earlier ones may be echoes of the motion.
const SETTLED: f64 = 0.8;

/// Largest change of the bias in one step, as a share of a contact.
const MOST_AT_ONCE: f64 = 0.1;

/// Averages external torques while the arm rests and the board is out of everybody's reach.
#[derive(Debug, Clone, Copy)]
pub(in crate::safety) struct TorqueBias {
    config: BiasConfig,
    /// Duration of the rest so far, s.
    rested_s: f64,
    /// Mean and number of the samples of this rest.
    mean: JointTorques,
    samples: u32,
    /// Time stamp of the newest sample, s: repeated samples do not count.
    last_s: Option<f64>,
    bias: Option<JointTorques>,
    /// Time since the bias was last measured, s.
    age_s: f64,
    /// Filtered torque beyond the bias, N m.
    beyond: JointTorques,
}

impl TorqueBias {
    pub(in crate::safety) const fn new(config: BiasConfig) -> Self {
        Self {
            config,
            rested_s: 0.0,
            mean: JointTorques([0.0; MOST_JOINTS]),
            samples: 0,
            last_s: None,
            bias: None,
            age_s: 0.0,
            beyond: JointTorques([0.0; MOST_JOINTS]),
        }
    }

    /// The joint with the largest contact torque relative to its limit, and that torque beyond its bias, N m, less the expected pushes. `None`
    /// without a bias. A push while the bias is measured is told, too, and the measurement starts anew.
    pub(in crate::safety) fn contact(
        &mut self,
        state: &ArmState,
        limits: &GuardLimits,
        dt_s: f64,
        unexplained: impl FnOnce(&JointTorques, &[f64; MOST_JOINTS]) -> JointTorques,
    ) -> Option<(usize, f64)> {
        let measured = (self.samples > 0).then_some(self.mean);
        let (bias, torque) = (self.bias.or(measured)?, state.external_torque?);
        let share = low_pass::share(dt_s, self.config.contact_filter_s);
        for joint in 0..MOST_JOINTS {
            let beyond = &mut self.beyond[joint];
            *beyond += share * (torque[joint] - bias[joint] - *beyond);
        }
        let unit_n_m = self.unit_n_m(limits);
        let left = unexplained(&self.beyond, &unit_n_m);
        let mut most: Option<(usize, f64)> = None;
        for joint in 0..MOST_JOINTS {
            let of_limit = left[joint].abs() / unit_n_m[joint];
            if of_limit > most.map_or(1.0, |(_, of_limit)| of_limit) {
                most = Some((joint, of_limit));
            }
        }
        if self.bias.is_none() && most.is_some() {
            (self.rested_s, self.samples) = (0.0, 0);
            self.beyond = JointTorques([0.0; MOST_JOINTS]);
        }
        most.map(|(joint, _)| (joint, left[joint]))
    }

    /// Torque of each joint that counts as a contact, N m.
    fn unit_n_m(&self, limits: &GuardLimits) -> [f64; MOST_JOINTS] {
        limits
            .torque_n_m
            .map(|most| self.config.contact_share * most)
    }

    /// The bias, N m.
    pub(in crate::safety) const fn bias(&self) -> Option<JointTorques> {
        self.bias
    }

    /// One cycle. `out_of_reach`: nobody can touch the board. A non-finite state ends the rest.
    pub(in crate::safety) fn step(
        &mut self,
        state: &ArmState,
        limits: &GuardLimits,
        out_of_reach: bool,
        dt_s: f64,
    ) {
        self.age_s += dt_s;
        let slow = |qd: &f64| qd.abs() <= self.config.rest_rad_per_s;
        let torque = state.external_torque.filter(|torque| {
            out_of_reach
                && state.qd.0.iter().all(slow)
                && torque.0.iter().all(|torque| torque.is_finite())
        });
        let Some(torque) = torque else {
            (self.rested_s, self.samples) = (0.0, 0);
            return;
        };
        self.rested_s += dt_s;
        let is_new = self.last_s.replace(state.t_s) != Some(state.t_s);
        if !is_new || self.rested_s < SETTLED * self.config.rest_s {
            return;
        }
        self.samples = self.samples.saturating_add(1);
        if self.samples == 1 {
            self.mean = torque;
        }
        // A plain mean at first, later an exponential one.
        let filtered = low_pass::share(dt_s, self.config.filter_s);
        let share = filtered.max(1.0 / f64::from(self.samples));
        for joint in 0..MOST_JOINTS {
            self.mean[joint] += share * (torque[joint] - self.mean[joint]);
        }
        if self.samples >= self.config.least_samples && self.rested_s >= self.config.rest_s {
            let mut bias = self.bias.unwrap_or(self.mean);
            // After a long time without a rest, a push must not become part of it all at once.
            let share = (self.age_s / self.config.drift_s).min(MOST_AT_ONCE);
            for (joint, unit_n_m) in self.unit_n_m(limits).into_iter().enumerate() {
                let most = share * unit_n_m;
                bias[joint] += (self.mean[joint] - bias[joint]).clamp(-most, most);
            }
            (self.bias, self.age_s) = (Some(bias), 0.0);
        }
    }

    /// The first joint whose bias exceeds the tolerance, and the bias, N m.
    pub(in crate::safety) fn beyond(
        &self,
        joints: usize,
        limits: &GuardLimits,
    ) -> Option<(usize, f64)> {
        let bias = self.bias?;
        (0..joints.min(MOST_JOINTS))
            .find(|i| bias[*i].abs() > self.config.most_share * limits.torque_n_m[*i])
            .map(|i| (i, bias[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_kinematics::{JointPositions, JointVelocities};
    use hwall_testkit::Sampler;

    fn limits() -> GuardLimits {
        GuardLimits::of_arm(&hwall_kinematics::SrsArm::iiwa7())
    }

    /// A cycle of a resting arm; is a push felt?
    fn is_pushed(bias: &mut TorqueBias, limits: &GuardLimits, state: &ArmState) -> bool {
        let contact = bias.contact(state, limits, 1e-3, |beyond, _| *beyond);
        bias.step(state, limits, contact.is_none(), 1e-3);
        contact.is_some()
    }

    fn state(t_s: f64, torque_n_m: f64) -> ArmState {
        ArmState {
            t_s,
            q: JointPositions::default(),
            qd: JointVelocities::default(),
            external_torque: Some(JointTorques([torque_n_m; MOST_JOINTS])),
        }
    }

    #[test]
    fn a_push_while_the_bias_is_measured_is_no_bias() {
        let limits = limits();
        for pushed in [0.30..0.42, 0.42..0.44, 0.45..0.47, 0.49..0.52] {
            let mut bias = TorqueBias::new(BiasConfig::default());
            for k in 0..1500 {
                let t_s = 1e-3 * f64::from(k);
                let torque_n_m = if pushed.contains(&t_s) { 15.0 } else { 0.1 };
                is_pushed(&mut bias, &limits, &state(t_s, torque_n_m));
                let found = bias.bias().map_or(0.1, |found| found[0]);
                assert!((found - 0.1).abs() < 0.5, "{pushed:?}, {t_s} s: {found}");
            }
            assert!(bias.bias().is_some(), "{pushed:?}");
        }
    }

    #[test]
    fn a_bias_is_a_mean_of_many_samples_from_the_beginning() {
        let limits = limits();
        let mut sampler = Sampler::new(5);
        let mut bias = TorqueBias::new(BiasConfig::default());
        for k in 0..2000 {
            let t_s = 1e-3 * f64::from(k);
            let state = state(t_s, 5.0 + 3.0 * sampler.normal());
            bias.step(&state, &limits, true, 1e-3);
            if let Some(found) = bias.bias() {
                assert!((found[0] - 5.0).abs() < 1.5, "{t_s} s: {found:?}");
            } else {
                assert!(t_s < 0.51, "{t_s} s");
            }
        }
        // Each rest starts anew: no sample of the last one remains.
        bias.step(&state(2.0, 5.0), &limits, false, 1e-3);
        assert_eq!(bias.samples, 0);
    }

    /// A hand that presses harder by 2 N m a second, and sensors that drift by 0.2 N m a minute.
    #[test]
    fn a_growing_push_is_no_bias_and_a_drift_is() {
        let limits = limits();
        for (n_m_per_s, after_s) in [(2.0, Some(1.0)), (-2.0, Some(1.0)), (0.2 / 60.0, None)] {
            let mut bias = TorqueBias::new(BiasConfig::default());
            let named = (0..900_000).find(|k| {
                let t_s = 1e-3 * f64::from(*k);
                let state = state(t_s, n_m_per_s * (t_s - 1.0).max(0.0));
                is_pushed(&mut bias, &limits, &state)
            });
            // The wrist is the first to notice: 3 % of 40 N m.
            let named_s = named.map(|k| 1e-3 * f64::from(k));
            assert_eq!(named_s.is_some(), after_s.is_some(), "{named_s:?}");
            let late = named_s.unwrap_or(0.0) - after_s.unwrap_or(0.0);
            assert!(late < 0.7, "{late} s");
        }
    }

    #[test]
    fn the_same_sample_again_and_one_that_is_not_finite_are_none() {
        let limits = limits();
        let mut bias = TorqueBias::new(BiasConfig::default());
        for _ in 0..2000 {
            bias.step(&state(1.0, 5.0), &limits, true, 1e-3);
        }
        assert_eq!(bias.bias(), None);
        for k in 0..2000 {
            let torque_n_m = if k % 40 == 0 { f64::NAN } else { 5.0 };
            bias.step(&state(1e-3 * f64::from(k), torque_n_m), &limits, true, 1e-3);
        }
        assert_eq!(bias.bias(), None);
    }
}
