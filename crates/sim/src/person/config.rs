//! Settings of a simulated person.

use super::draw::Draw;
use super::gesture::Gesture;
use super::profile::PEAKS;
use crate::error::SimError;
use glam::DVec3;
use hwall_numeric::check::{all_finite, non_negative, positive, that};

/// Settings of a [`Person`](crate::Person). Pairs are ranges, smallest then largest; a value is drawn
/// uniformly once per person, or once per reach where noted.
///
/// The default is a nominal person: one gesture, symmetric speed profile, a gaze that never misses.
/// [`PersonConfig::varied`] enables all traits in which people differ.
///
/// Coordinates are in the robot's base frame, z up. Defaults without a source are assumptions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonConfig {
    /// Point between the eyes, m. Default (1.3, 0, 1.0): in front of the arm, whose base stands
    /// on a table, so the floor is about 0.65 m below it.
    pub head_m: DVec3,
    /// Scatter of the head position between people, sd per axis, m. Default 0.
    pub head_scatter_m: f64,
    /// Horizontal lean of the head towards the target during a reach, m. Default 0.
    pub lean_m: [f64; 2],
    /// Facing direction; only the horizontal part is used. Default -x, towards the arm.
    pub facing: DVec3,
    /// Tip of the index finger at rest, m. Default (0.95, 0.15, 0.72): half raised, on the
    /// right.
    pub hand_rest_m: DVec3,
    /// Scatter from one rest to the next, sd per axis, m. Default 0.
    pub rest_scatter_m: f64,
    /// Hand gesture; `None` draws one of the three per person. Default pointing.
    pub gesture: Option<Gesture>,
    /// Does the hand take the shape of its gesture only on the way, from a hand at rest that is the same for all gestures, and not always fully?
    /// Default no.
    pub takes_shape: bool,
    /// Deviation of the direction of the extended fingers, drawn per person and again per reach, sd in
    /// each of two directions, rad; at most 0.2. Default 0.
    pub posture_rad: f64,
    /// Length of the hand, wrist to middle fingertip, m. Default 0.17 to 0.205.
    pub hand_length_m: [f64; 2],
    /// A person's mean duration of a reach over [`PersonConfig::REFERENCE_M`], from start to full depth, s. Default 0.6 to 1.2; single
    /// reaches vary by 10 %.
    pub mean_reach_s: [f64; 2],
    /// Durations grow with this power of the distance, 0 to 1. Default 0, no growth; 0.5 keeps the
    /// peak acceleration constant.
    pub distance_exponent: f64,
    /// Fraction of the movement time at which the speed peaks, 0.3 to 0.7. In a corrected movement, it is a fraction of the first part,
    /// which lasts 80 % of the time. Default 0.5.
    pub speed_peak: [f64; 2],
    /// Fraction of the reaches that fall short at first and are corrected, 0 to 1. Default 0.
    pub corrections: f64,
    /// Undershoot of the corrected reaches as a fraction of the distance, at most 0.3. Half of it is the standard deviation of the miss in
    /// each of two directions along the surface. Default 0.05 to 0.1.
    pub undershoot: [f64; 2],
    /// Largest lateral deviation from the straight path, as a fraction of its length. Default 0.01 to 0.05.
    pub curvature: [f64; 2],
    /// Relative scatter of bow, peak and undershoot from reach to reach, sd; at most 0.5. Default 0.
    pub reach_scatter: f64,
    /// Intended fingertip depth beyond the surface, per reach, m. Default 0.008 to 0.02: 4 to 10 N at 500 N/m.
    pub press_depth_m: [f64; 2],
    /// Time at that depth, per reach, s. Default 0.5 to 1.
    pub hold_s: [f64; 2],
    /// Rest before the gaze leaves for the next target, per reach, s. Default 0.5 to 1.2.
    pub pause_s: [f64; 2],
    /// Mean time from the start of the gaze shift to the start of the hand, s. Default 0.3; scatters by 15 %.
    pub gaze_lead_s: [f64; 2],
    /// Additional dwell of the hand before it starts, per reach, s. Default 0.
    pub onset_dwell_s: [f64; 2],
    /// Deviation of the gaze from the target, constant during a fixation, sd in each of two
    /// directions, rad. Default 1 degree.
    pub gaze_offset_rad: f64,
    /// Noise of the eye tracker on every sample, sd in each of two directions, rad. Default 0.5
    /// degrees.
    pub gaze_noise_rad: f64,
    /// Fraction of the reaches in which the gaze is off target throughout, by 15 to 40 degrees, 0 to 1. Default 0.
    pub gaze_misses: f64,
    /// Fraction of the reaches in which the gaze leaves the target 0.05 to 0.25 s before contact, 0 to 1. Default 0.
    pub gaze_leaves: f64,
    /// Number of glances at untouched points per pause, fewest and most; at most [`PersonConfig::MOST_PLACES`]. Default
    /// none: between touches the gaze rests straight ahead. The points come with the plan, see
    /// [`Person::plan_looking`](crate::Person::plan_looking); a pause that is too short is extended.
    pub glances: [usize; 2],
    /// Duration of each glance, s. Default 0.2 to 0.6: fixations of a scene last 0.26 to 0.33 s on average [Rayner 2009],
    /// and inspecting an object takes one or two of them [Land 2001].
    pub glance_s: [f64; 2],
    /// Fraction of the pauses in which the gaze then returns once to one of these points, or to the point touched before, 0 to
    /// 1. Default 0.
    pub glances_back: f64,
    /// Amplitude of the tremor of the hand, m. Default 0.0003, at frequencies from 8 to 12 Hz.
    pub tremor_m: [f64; 2],
    /// Noise of the tracker on palm, fingertips and head, sd per axis, m. Default 0.0007.
    pub tracker_noise_m: f64,
    /// Fraction of the time in which the tracker loses a point, independently for the palm, each
    /// fingertip and the gaze, 0 to 1. Default 0.
    pub dropout: f64,
    /// Shortest dropout, s. Default 0.05; below the tracker's period, single samples are missing.
    pub dropout_s: f64,
}

/// Purpose of the draws of [`PersonConfig::random`].
const RANDOM: u64 = 0x726e_646d;

impl Default for PersonConfig {
    fn default() -> Self {
        Self {
            head_m: DVec3::new(1.3, 0.0, 1.0),
            head_scatter_m: 0.0,
            lean_m: [0.0; 2],
            facing: DVec3::NEG_X,
            hand_rest_m: DVec3::new(0.95, 0.15, 0.72),
            rest_scatter_m: 0.0,
            gesture: Some(Gesture::Pointing),
            takes_shape: false,
            posture_rad: 0.0,
            hand_length_m: [0.17, 0.205],
            mean_reach_s: [0.6, 1.2],
            distance_exponent: 0.0,
            speed_peak: [0.5; 2],
            corrections: 0.0,
            undershoot: [0.05, 0.1],
            curvature: [0.01, 0.05],
            reach_scatter: 0.0,
            press_depth_m: [0.008, 0.02],
            hold_s: [0.5, 1.0],
            pause_s: [0.5, 1.2],
            gaze_lead_s: [0.3; 2],
            onset_dwell_s: [0.0; 2],
            gaze_offset_rad: 1_f64.to_radians(),
            gaze_noise_rad: 0.5_f64.to_radians(),
            gaze_misses: 0.0,
            gaze_leaves: 0.0,
            glances: [0; 2],
            glance_s: [0.2, 0.6],
            glances_back: 0.0,
            tremor_m: [0.0003; 2],
            tracker_noise_m: 0.0007,
            dropout: 0.0,
            dropout_s: 0.05,
        }
    }
}

impl PersonConfig {
    /// Reference distance of the durations, m.
    pub const REFERENCE_M: f64 = 0.5;

    /// Maximum number of points that the gaze visits in one pause.
    pub const MOST_PLACES: usize = 3;

    /// Maximum number of glances in one pause: one per point, and one return.
    pub const MOST_GLANCES: usize = Self::MOST_PLACES + 1;

    /// Realistic people: all traits enabled, magnitudes assumed.
    #[must_use]
    pub fn varied() -> Self {
        Self {
            head_scatter_m: 0.05,
            lean_m: [0.0, 0.06],
            rest_scatter_m: 0.03,
            gesture: None,
            posture_rad: 0.1,
            distance_exponent: 0.5,
            speed_peak: [0.34, 0.5],
            corrections: 0.7,
            curvature: [0.01, 0.08],
            reach_scatter: 0.25,
            gaze_lead_s: [0.15, 0.45],
            onset_dwell_s: [0.0, 0.2],
            gaze_misses: 0.1,
            gaze_leaves: 0.3,
            tremor_m: [0.0002, 0.0008],
            tracker_noise_m: 0.001,
            dropout: 0.03,
            ..Self::default()
        }
    }

    /// A nominal person who reaches fast: in 0.35 to 0.6 s, an assumption.
    #[must_use]
    pub fn fast() -> Self {
        Self {
            mean_reach_s: [0.35, 0.6],
            ..Self::default()
        }
    }

    /// A nominal person who reaches slowly: in 1.2 to 2 s, an assumption.
    #[must_use]
    pub fn slow() -> Self {
        Self {
            mean_reach_s: [1.2, 2.0],
            ..Self::default()
        }
    }

    /// A nominal person who looks around: 0 to 3 glances per pause, 0.2 to 0.6 s each, and a return in 30 % of the pauses.
    ///
    /// Only the gaze between touches differs from the default, to isolate the effect of glances. During manual work nearly every fixation
    /// serves the task, and the eyes reach the next object half a second before the hand [Land 2001]. But a fixation need not be followed
    /// directly by a reach: 20 % of the reaches were preceded by a fixation on the target about 3 s earlier, with other fixations in between
    /// [Mennie 2007]. The literature gives no number of unrelated glances for this task: the counts are a pessimistic assumption.
    #[must_use]
    pub fn glancing() -> Self {
        Self {
            glances: [0, 3],
            glances_back: 0.3,
            ..Self::default()
        }
    }

    /// A person unlike the other presets: most traits are drawn from ranges at least as wide as those of [`varied`](Self::varied), none of
    /// them from data; the others, such as press and hold, have their default. Use it to evaluate what was developed with the other presets.
    #[must_use]
    pub fn random(seed: u64) -> Self {
        let mut draw = Draw::new(seed, RANDOM);
        let away = DVec3::new(draw.within([-0.1, 0.2]), 0.0, draw.within([-0.15, 0.15]));
        let hand = DVec3::new(0.0, draw.within([-0.2, 0.2]), draw.within([-0.1, 0.1]));
        let reach_s = draw.within([0.45, 1.5]);
        let spread = |mean: f64, by: f64| [mean * (1.0 - by), mean * (1.0 + by)];
        let most_glances = draw.index(Self::MOST_PLACES + 1);
        let nominal = Self::default();
        Self {
            head_m: nominal.head_m + away,
            hand_rest_m: nominal.hand_rest_m + away + hand,
            rest_scatter_m: draw.within([0.0, 0.04]),
            lean_m: [0.0, draw.within([0.0, 0.1])],
            gesture: None,
            posture_rad: draw.within([0.0, 0.15]),
            mean_reach_s: spread(reach_s, 0.05),
            distance_exponent: draw.within([0.0, 0.7]),
            speed_peak: spread(draw.within([0.33, 0.6]), 0.05),
            corrections: draw.within([0.0, 1.0]),
            curvature: [0.0, draw.within([0.02, 0.12])],
            reach_scatter: draw.within([0.0, 0.4]),
            pause_s: spread(draw.within([0.2, 1.5]), 0.3),
            gaze_lead_s: spread(draw.within([0.05, 0.6]), 0.2),
            onset_dwell_s: [0.0, draw.within([0.0, 0.5])],
            gaze_offset_rad: draw.within([0.5, 3.0]).to_radians(),
            gaze_noise_rad: draw.within([0.2, 1.5]).to_radians(),
            gaze_misses: draw.within([0.0, 0.3]),
            gaze_leaves: draw.within([0.0, 1.0]),
            glances: [0, most_glances],
            glances_back: draw.within([0.0, 0.5]),
            tremor_m: spread(draw.within([0.0002, 0.001]), 0.2),
            tracker_noise_m: draw.within([0.0003, 0.003]),
            dropout: draw.within([0.0, 0.08]),
            ..nominal
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// NaN, infinity, a reversed range, or a setting outside its range, by name.
    pub fn validate(&self) -> Result<(), SimError> {
        all_finite("head_m", &self.head_m.to_array())?;
        all_finite("facing", &self.facing.to_array())?;
        all_finite("hand_rest_m", &self.hand_rest_m.to_array())?;
        positive("horizontal part of facing", self.facing.truncate().length())?;
        for (what, range) in [
            ("hand_length_m", self.hand_length_m),
            ("mean_reach_s", self.mean_reach_s),
            ("press_depth_m", self.press_depth_m),
            ("hold_s", self.hold_s),
            ("pause_s", self.pause_s),
            ("gaze_lead_s", self.gaze_lead_s),
            ("glance_s", self.glance_s),
        ] {
            positive(what, range[0])?;
            rising(what, range, f64::INFINITY)?;
        }
        for (what, range, most) in [
            ("lean_m", self.lean_m, f64::INFINITY),
            ("undershoot", self.undershoot, 0.3),
            ("curvature", self.curvature, 0.5),
            ("onset_dwell_s", self.onset_dwell_s, f64::INFINITY),
            ("tremor_m", self.tremor_m, f64::INFINITY),
        ] {
            non_negative(what, range[0])?;
            rising(what, range, most)?;
        }
        rising("speed_peak", self.speed_peak, PEAKS[1])?;
        between("speed_peak", self.speed_peak[0], PEAKS)?;
        for (what, value) in [
            ("head_scatter_m", self.head_scatter_m),
            ("rest_scatter_m", self.rest_scatter_m),
            ("gaze_offset_rad", self.gaze_offset_rad),
            ("gaze_noise_rad", self.gaze_noise_rad),
            ("tracker_noise_m", self.tracker_noise_m),
        ] {
            non_negative(what, value)?;
        }
        for (what, value, most) in [
            ("posture_rad", self.posture_rad, 0.2),
            ("distance_exponent", self.distance_exponent, 1.0),
            ("corrections", self.corrections, 1.0),
            ("reach_scatter", self.reach_scatter, 0.5),
            ("gaze_misses", self.gaze_misses, 1.0),
            ("gaze_leaves", self.gaze_leaves, 1.0),
            ("glances_back", self.glances_back, 1.0),
            ("dropout", self.dropout, 1.0),
        ] {
            between(what, value, [0.0, most])?;
        }
        let [fewest, most] = self.glances;
        let within = fewest <= most && most <= Self::MOST_PLACES;
        that(
            within,
            "glances",
            most as f64,
            "at least the lower number, at most 3",
        )?;
        positive("dropout_s", self.dropout_s)?;
        // With a smaller depth, the tremor alone could move the tip back through the surface.
        let depth_m = self.press_depth_m[0];
        let deep = depth_m >= 2.0 * self.tremor_m[1];
        that(deep, "press_depth_m", depth_m, "at least twice the tremor")?;
        Ok(())
    }
}

/// A range whose upper end is finite, at most `most` and not below the lower one.
fn rising(what: &'static str, [lo, hi]: [f64; 2], most: f64) -> Result<(), SimError> {
    non_negative(what, hi)?;
    let wanted = "at least the lower end of its range and within its bounds";
    that(lo <= hi && hi <= most, what, hi, wanted)?;
    Ok(())
}

fn between(what: &'static str, value: f64, [lo, hi]: [f64; 2]) -> Result<(), SimError> {
    that(lo <= value && value <= hi, what, value, "within its bounds")?;
    Ok(())
}
