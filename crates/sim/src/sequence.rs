//! A planned sequence of touches, sampled at any time.

use crate::hand::{self, Gesture};
use crate::person::{Habits, PersonConfig};
use crate::reach::{ReachPath, TouchTruth, bisect, minimum_jerk};
use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Duration of a saccade, s; they last 0.02 to 0.1 s, longer for larger angles.
const SACCADE_S: f64 = 0.06;
/// Sway of a standing person's head, m, and its frequencies, Hz: an assumption.
const SWAY_M: f64 = 0.004;
const SWAY_HZ: [f64; 2] = [0.23, 0.31];
/// Half the time over which velocities are taken, s: the error, jerk times its square over 6, is
/// below 1e-7 m/s up to 6000 m/s³, twenty times what a reach has.
const DIFFERENCE_S: f64 = 1e-5;

/// Hand, head and gaze at one instant, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonSample {
    /// Time from the start of the sequence, s.
    pub t_s: f64,
    /// Centre of the palm, m.
    pub palm_m: DVec3,
    /// Fingertips, thumb first, m.
    pub tips_m: [DVec3; 5],
    /// Point between the eyes, where the gaze starts, m.
    pub head_m: DVec3,
    /// Unit direction of the gaze.
    pub gaze: DVec3,
}

/// Times of a touch that are set before the crossings of the surface are known, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timeline {
    pub(crate) look_s: f64,
    pub(crate) start_s: f64,
    pub(crate) press_s: f64,
    pub(crate) withdraw_s: f64,
    pub(crate) end_s: f64,
}

impl Timeline {
    /// Share of the way, in time: 0 at rest, 1 pressing.
    fn tau(&self, t_s: f64) -> f64 {
        if t_s <= self.press_s {
            ((t_s - self.start_s) / (self.press_s - self.start_s)).max(0.0)
        } else {
            (1.0 - (t_s - self.withdraw_s) / (self.end_s - self.withdraw_s)).clamp(0.0, 1.0)
        }
    }
}

/// One touch as planned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touch {
    pub(crate) path: ReachPath,
    pub(crate) timeline: Timeline,
    pub(crate) target_m: DVec3,
    pub(crate) depth_m: f64,
    /// Direction of the stretched fingers at contact.
    pub(crate) fingers: DVec3,
    pub(crate) gaze_offset_rad: [f64; 2],
}

/// A person's rests and touches over time.
///
/// Everything is a pure function of the time: samples may be taken in any order and as often as
/// wanted, and the noise of an instant is always the same. Before the first touch and after the
/// last one the person rests. NaN or infinity in gives NaN out.
#[derive(Debug, Clone, PartialEq)]
pub struct TouchSequence {
    habits: Habits,
    seed: u64,
    gesture: Gesture,
    forward: DVec3,
    head_m: DVec3,
    hand_rest_m: DVec3,
    tremor_m: f64,
    tracker_noise_m: f64,
    gaze_noise_rad: f64,
    touches: Vec<Touch>,
    truths: Vec<TouchTruth>,
}

impl TouchSequence {
    pub(crate) fn new(
        config: &PersonConfig,
        habits: Habits,
        seed: u64,
        forward: DVec3,
        touches: Vec<Touch>,
    ) -> Self {
        let mut sequence = Self {
            habits,
            seed,
            gesture: config.gesture,
            forward,
            head_m: config.head_m,
            hand_rest_m: config.hand_rest_m,
            tremor_m: config.tremor_m,
            tracker_noise_m: config.tracker_noise_m,
            gaze_noise_rad: config.gaze_noise_rad,
            touches,
            truths: Vec::new(),
        };
        sequence.truths = sequence
            .touches
            .iter()
            .map(|touch| sequence.measure(touch))
            .collect();
        sequence
    }

    /// What really happens, touch by touch.
    #[must_use]
    pub fn touches(&self) -> &[TouchTruth] {
        &self.truths
    }

    /// The touch going on at a time, from the look to the end of the withdrawal.
    #[must_use]
    pub fn touch_at(&self, t_s: f64) -> Option<&TouchTruth> {
        self.truths
            .iter()
            .find(|touch| touch.look_s <= t_s && t_s <= touch.end_s)
    }

    /// End of the last touch, s; 0 without any.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.truths.last().map_or(0.0, |touch| touch.end_s)
    }

    /// What the trackers measure: [`truth`](Self::truth) with noise, white over the times asked for.
    #[must_use]
    pub fn sample(&self, t_s: f64) -> PersonSample {
        let mut sample = self.truth(t_s);
        // The bits of the time seed the noise; seed_from_u64 scrambles neighbouring seeds.
        let mut generator = Pcg64::seed_from_u64(self.seed.rotate_left(32) ^ t_s.to_bits());
        let mut normal = || generator.sample::<f64, _>(StandardNormal);
        let mut jitter = |point: &mut DVec3| {
            *point += DVec3::new(normal(), normal(), normal()) * self.tracker_noise_m;
        };
        jitter(&mut sample.palm_m);
        sample.tips_m.iter_mut().for_each(&mut jitter);
        jitter(&mut sample.head_m);
        sample.gaze = deflected(
            sample.gaze,
            [normal(), normal()].map(|x| x * self.gaze_noise_rad),
        );
        sample
    }

    /// Where hand, head and gaze really are, tremor and the deviation of the gaze included.
    #[must_use]
    pub fn truth(&self, t_s: f64) -> PersonSample {
        if !t_s.is_finite() {
            let nan = DVec3::NAN;
            return PersonSample {
                t_s,
                palm_m: nan,
                tips_m: [nan; 5],
                head_m: nan,
                gaze: nan,
            };
        }
        let current = self.current(t_s);
        let share = current.map_or(0.0, |touch| touch.path.approach(touch.timeline.tau(t_s)));
        let at_rest = hand::orientation((self.forward - DVec3::Z * 0.3).normalize());
        let base_from_hand = current.map_or(at_rest, |touch| {
            at_rest.slerp(hand::orientation(touch.fingers), share)
        });
        let index_tip_m = self.true_index_tip(t_s);
        let (palm_m, mut tips_m) = hand::place(
            self.gesture,
            self.habits.hand_length_m,
            base_from_hand,
            index_tip_m,
        );
        if let Some(touch) = current {
            // The other fingers give way: none goes through the surface ahead of the index finger.
            let height_m = |point_m: DVec3| (point_m - touch.target_m).dot(touch.path.normal());
            let floor_m = height_m(index_tip_m).min(0.0);
            for tip_m in &mut tips_m {
                *tip_m += touch.path.normal() * (share * (floor_m - height_m(*tip_m)).max(0.0));
            }
        }
        let head_m = self.true_head(t_s);
        PersonSample {
            t_s,
            palm_m,
            tips_m,
            head_m,
            gaze: self.true_gaze(t_s, head_m),
        }
    }

    /// Where the tip of the index finger would be if nothing stopped it, base frame, m.
    #[must_use]
    pub fn true_index_tip(&self, t_s: f64) -> DVec3 {
        if !t_s.is_finite() {
            return DVec3::NAN;
        }
        let calm_m = match self.current(t_s) {
            Some(touch) => touch.path.tip_m(touch.timeline.tau(t_s)),
            None => self.hand_rest_m,
        };
        calm_m + self.tremor(t_s)
    }

    /// Velocity of [`true_index_tip`](Self::true_index_tip), base axes, m/s; error below 1e-7 m/s.
    ///
    /// NaN also for times beyond 1e10 s, where an `f64` cannot hold the difference.
    #[must_use]
    pub fn true_index_velocity_m_per_s(&self, t_s: f64) -> DVec3 {
        let (before_s, after_s) = (t_s - DIFFERENCE_S, t_s + DIFFERENCE_S);
        (self.true_index_tip(after_s) - self.true_index_tip(before_s)) / (after_s - before_s)
    }

    /// The last touch whose look has begun: its path ends where the next one starts, at rest.
    fn current(&self, t_s: f64) -> Option<&Touch> {
        let begun = self
            .touches
            .partition_point(|touch| touch.timeline.look_s <= t_s);
        begun.checked_sub(1).map(|last| &self.touches[last])
    }

    fn tremor(&self, t_s: f64) -> DVec3 {
        let per_axis_m = self.tremor_m / 3_f64.sqrt();
        let wave = |[hz, phase_rad]: [f64; 2]| per_axis_m * (TAU * hz * t_s + phase_rad).sin();
        DVec3::from_array(self.habits.tremor.map(wave))
    }

    fn true_head(&self, t_s: f64) -> DVec3 {
        let [ahead, aside] = SWAY_HZ.map(|hz| SWAY_M * (TAU * hz * t_s).sin());
        self.head_m + self.forward * ahead + self.forward.cross(DVec3::Z) * aside
    }

    /// Ahead and a little down at rest; on the target from the look until the hand withdraws.
    fn true_gaze(&self, t_s: f64, head_m: DVec3) -> DVec3 {
        let at_rest = (self.forward - DVec3::Z * 0.2).normalize();
        let Some(touch) = self.current(t_s) else {
            return at_rest;
        };
        let exact = (touch.target_m - head_m).normalize_or(at_rest);
        let on_target = deflected(exact, touch.gaze_offset_rad);
        let Timeline {
            look_s, withdraw_s, ..
        } = touch.timeline;
        let there = minimum_jerk((t_s - look_s) / SACCADE_S);
        let back = minimum_jerk((t_s - withdraw_s) / SACCADE_S);
        let turn = DQuat::from_rotation_arc(at_rest, on_target);
        (DQuat::IDENTITY.slerp(turn, there - back) * at_rest).normalize()
    }

    /// Finds the crossings of the surface, tremor included.
    fn measure(&self, touch: &Touch) -> TouchTruth {
        let Timeline {
            look_s,
            start_s,
            press_s,
            withdraw_s,
            end_s,
        } = touch.timeline;
        let (target_m, normal, depth_m) = (touch.target_m, touch.path.normal(), touch.depth_m);
        let outside = |t_s: f64| {
            let tip_m = touch.path.tip_m(touch.timeline.tau(t_s)) + self.tremor(t_s);
            (tip_m - target_m).dot(normal) > 0.0
        };
        let contact_s = bisect(start_s, press_s, outside);
        let release_s = bisect(withdraw_s, end_s, |t_s| !outside(t_s));
        TouchTruth {
            target_m,
            normal,
            depth_m,
            look_s,
            start_s,
            contact_s,
            press_s,
            withdraw_s,
            release_s,
            end_s,
        }
    }
}

/// A unit vector turned by small angles about two axes across it.
fn deflected(direction: DVec3, [a_rad, b_rad]: [f64; 2]) -> DVec3 {
    let (u, v) = direction.any_orthonormal_pair();
    (direction + u * a_rad.tan() + v * b_rad.tan()).normalize()
}
