//! A planned sequence of touches, sampled at any time.

use super::bisect::bisect;
use super::draw::scrambled;
use super::gaze::{self, deflected};
use super::gesture;
use super::habits::Person;
use super::planned_touch::{PlannedTouch, Timeline};
use super::reach::{ChangeOfMind, TouchTruth};
use glam::DVec3;
use hwall_hand::HandFrame;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Sway of a standing person's head, m, and its frequencies, Hz: an assumption.
const SWAY_M: f64 = 0.004;
const SWAY_HZ: [f64; 2] = [0.23, 0.31];
/// Half width of the velocity differences, s: the error is the jerk times the square of this, over 6. It is below
/// 1e-7 m/s for jerks up to 6000 m/s³, twenty times the jerk of a reach.
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
    /// Point between the eyes, origin of the gaze, m.
    pub head_m: DVec3,
    /// Unit direction of the gaze.
    pub gaze: DVec3,
}

impl PersonSample {
    /// The sample as a tracker frame without missing points.
    #[must_use]
    pub fn hand_frame(&self) -> HandFrame {
        HandFrame {
            t_s: self.t_s,
            palm_m: Some(self.palm_m),
            tips_m: self.tips_m.map(Some),
            head_m: Some(self.head_m),
            gaze: Some(self.gaze),
            ..HandFrame::default()
        }
    }
}

/// A person's rests and touches over time.
///
/// A pure function of time: samples may be taken in any order and at any rate, and the noise at an
/// instant is always the same. Before the first touch and after the last one the person rests. A time
/// that is NaN or infinite gives NaN, or `None` if the type allows it.
#[derive(Debug, Clone, PartialEq)]
pub struct TouchSequence {
    person: Person,
    first_rest_m: DVec3,
    touches: Vec<PlannedTouch>,
    truths: Vec<TouchTruth>,
}

impl TouchSequence {
    pub(super) fn new(person: Person, first_rest_m: DVec3, touches: Vec<PlannedTouch>) -> Self {
        let mut sequence = Self {
            person,
            first_rest_m,
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

    /// The person who touches.
    #[must_use]
    pub const fn person(&self) -> &Person {
        &self.person
    }

    /// Ground truth, touch by touch.
    #[must_use]
    pub fn touches(&self) -> &[TouchTruth] {
        &self.truths
    }

    /// End of the last touch, s; 0 without any.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.truths.last().map_or(0.0, |touch| touch.end_s)
    }

    /// Tracker measurement: [`truth`](Self::truth) with white noise over the sampled times.
    #[must_use]
    pub fn sample(&self, t_s: f64) -> PersonSample {
        let config = self.person.config();
        let mut sample = self.truth(t_s);
        // The bits of the time seed the noise; `seed_from_u64` scrambles neighbouring seeds.
        let mut generator =
            Pcg64::seed_from_u64(self.person.seed().rotate_left(32) ^ t_s.to_bits());
        let mut normal = || generator.sample::<f64, _>(StandardNormal);
        let mut jitter = |point: &mut DVec3| {
            *point += DVec3::new(normal(), normal(), normal()) * config.tracker_noise_m;
        };
        jitter(&mut sample.palm_m);
        sample.tips_m.iter_mut().for_each(&mut jitter);
        jitter(&mut sample.head_m);
        sample.gaze = deflected(
            sample.gaze,
            [normal(), normal()].map(|x| x * config.gaze_noise_rad),
        );
        sample
    }

    /// Tracker output, base frame: [`sample`](Self::sample) without the points lost at that time.
    /// All `None` for a time that is NaN or infinite.
    #[must_use]
    pub fn tracked(&self, t_s: f64) -> HandFrame {
        let sample = self.sample(t_s);
        let seen = |place: u64, point| (!self.is_lost(place, t_s)).then_some(point);
        HandFrame {
            t_s,
            palm_m: seen(0, sample.palm_m),
            tips_m: std::array::from_fn(|i| seen(1 + i as u64, sample.tips_m[i])),
            head_m: t_s.is_finite().then_some(sample.head_m),
            gaze: seen(6, sample.gaze),
            ..HandFrame::default()
        }
    }

    /// True if a point is lost at a time. Time is divided into cells in which a point is either
    /// lost or not, so that the fraction of lost time is as configured at any sampling rate.
    fn is_lost(&self, place: u64, t_s: f64) -> bool {
        let config = self.person.config();
        // The cells of different points are offset.
        let cell = (t_s / config.dropout_s + place as f64 / 7.0).floor();
        let stream = scrambled(self.person.seed() ^ scrambled(place));
        let number = scrambled(stream ^ cell.to_bits());
        // 53 bits give a number from 0 to 1.
        let share = (number >> 11) as f64 * (0.5_f64).powi(53);
        !t_s.is_finite() || share < config.dropout
    }

    /// True state of hand, head and gaze, including tremor and gaze deviation.
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
        let at_rest = gesture::orientation(self.person.fingers_at_rest());
        let index_tip_m = self.true_index_tip(t_s);
        let head_m = self.true_head(t_s);
        let hand = &self.person.habits().hand;
        let (palm_m, tips_m) = match self.current(t_s) {
            None => hand.place(0.0, at_rest, index_tip_m),
            Some(touch) => {
                let (path, changed) = touch.way(t_s);
                let tau = touch.timeline.tau(t_s);
                let share = path.approach(tau);
                let mut at_contact = hand.at_contact(touch.fingers, path.normal());
                if let Some(meant) = touch.fingers_meant {
                    let meant = hand.at_contact(meant, path.normal());
                    at_contact = meant.slerp(at_contact, changed);
                }
                let turned = at_rest.slerp(at_contact, share);
                let (palm_m, mut tips_m) = hand.place(path.elapsed(tau), turned, index_tip_m);
                // Move the other fingers back, so that none passes the surface before the index finger.
                let normal = path.normal();
                let height_m = |point_m: DVec3| (point_m - path.target_m()).dot(normal);
                let floor_m = height_m(index_tip_m).min(0.0);
                for tip_m in &mut tips_m {
                    let give_m = (floor_m - height_m(*tip_m)).max(0.0);
                    *tip_m += normal * (share * changed * give_m);
                }
                (palm_m, tips_m)
            }
        };
        PersonSample {
            t_s,
            palm_m,
            tips_m,
            head_m,
            gaze: self.true_gaze(t_s, head_m),
        }
    }

    /// Unobstructed position of the index fingertip, base frame, m.
    #[must_use]
    pub fn true_index_tip(&self, t_s: f64) -> DVec3 {
        if !t_s.is_finite() {
            return DVec3::NAN;
        }
        let calm_m = self
            .current(t_s)
            .map_or(self.first_rest_m, |touch| touch.tip_m(t_s));
        calm_m + self.tremor(t_s)
    }

    /// Velocity of [`true_index_tip`](Self::true_index_tip), base axes, m/s; error below 1e-7 m/s.
    ///
    /// NaN also for times beyond 1e10 s, where an `f64` cannot resolve the difference.
    #[must_use]
    pub fn true_index_velocity_m_per_s(&self, t_s: f64) -> DVec3 {
        let (before_s, after_s) = (t_s - DIFFERENCE_S, t_s + DIFFERENCE_S);
        (self.true_index_tip(after_s) - self.true_index_tip(before_s)) / (after_s - before_s)
    }

    /// The last touch whose gaze shift has started; its path ends at rest, where the next one starts.
    fn current(&self, t_s: f64) -> Option<&PlannedTouch> {
        let begun = self
            .touches
            .partition_point(|touch| touch.timeline.look_s <= t_s);
        begun.checked_sub(1).map(|last| &self.touches[last])
    }

    fn tremor(&self, t_s: f64) -> DVec3 {
        let habits = self.person.habits();
        let per_axis_m = habits.tremor_m / 3_f64.sqrt();
        let wave = |[hz, phase_rad]: [f64; 2]| per_axis_m * (TAU * hz * t_s + phase_rad).sin();
        DVec3::from_array(habits.tremor.map(wave))
    }

    /// The rest position plus sway and lean towards the target.
    fn true_head(&self, t_s: f64) -> DVec3 {
        let (rest_m, forward) = (self.person.head_m(), self.person.forward());
        let [ahead, aside] = SWAY_HZ.map(|hz| SWAY_M * (TAU * hz * t_s).sin());
        let sway_m = forward * ahead + forward.cross(DVec3::Z) * aside;
        let lean = self.current(t_s).map_or(DVec3::ZERO, |touch| {
            let (path, changed) = touch.way(t_s);
            let meant_m = touch.approach.meant.map(|(meant, _)| meant.target_m());
            let to_m = meant_m.map_or(path.target_m(), |m| m.lerp(path.target_m(), changed));
            let towards = (to_m - rest_m).truncate().normalize_or_zero();
            towards.extend(0.0) * path.approach(touch.timeline.tau(t_s))
        });
        rest_m + sway_m + lean * self.person.habits().lean_m
    }

    /// At rest, ahead and slightly down.
    fn true_gaze(&self, t_s: f64, head_m: DVec3) -> DVec3 {
        let ahead = (self.person.forward() - DVec3::Z * 0.2).normalize();
        // Glances precede the gaze shift that starts a touch; before them, the gaze has been straight ahead since
        // the last touch.
        let begun = |touch: &PlannedTouch| touch.gaze.first().is_some_and(|f| f.from_s <= t_s);
        let last = self.touches.partition_point(begun).checked_sub(1);
        let fixations = last.map_or(&[][..], |last| &self.touches[last].gaze);
        gaze::direction(fixations, t_s, ahead, head_m)
    }

    /// Computes the surface crossings, tremor included.
    fn measure(&self, touch: &PlannedTouch) -> TouchTruth {
        let Timeline {
            look_s,
            start_s,
            press_s,
            withdraw_s,
            end_s,
        } = touch.timeline;
        let path = &touch.approach.path;
        let (target_m, normal) = (path.target_m(), path.normal());
        let outside = |t_s: f64| {
            let tip_m = touch.tip_m(t_s) + self.tremor(t_s);
            (tip_m - target_m).dot(normal) > 0.0
        };
        // While moving to another target the tip may cross this plane without contact.
        let settled_s = touch.timeline.on_the_way_s(touch.approach.tau_settled());
        let changed = touch.approach.meant.as_ref().and_then(|(meant, _)| {
            Some(ChangeOfMind {
                target_m: meant.target_m(),
                normal: meant.normal(),
                switch_s: touch.timeline.switch_s(&touch.approach)?,
            })
        });
        TouchTruth {
            target_m,
            normal,
            depth_m: touch.depth_m,
            look_s,
            start_s,
            contact_s: bisect(settled_s, press_s, outside),
            press_s,
            withdraw_s,
            release_s: bisect(withdraw_s, end_s, |t_s| !outside(t_s)),
            end_s,
            changed,
            gaze_missed: touch.gaze_missed,
            landed_s: touch.landed_s,
            glances: touch.glances,
        }
    }
}
