//! A simulated person: habits drawn from a seed, and touches planned with them.

use crate::error::{finite, not_negative, positive};
use crate::hand::Gesture;
use crate::reach::ReachPath;
use crate::sequence::{Timeline, Touch, TouchSequence};
use crate::{SimError, TouchPlan};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Settings of a [`Person`]. Pairs are ranges, smallest then largest, drawn from uniformly.
///
/// Lengths and angles are in the robot's base frame, z up. Where no source is named the default
/// is an assumption.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonConfig {
    /// Point between the eyes, m. Default (1.3, 0, 1.0): in front of the arm, whose base stands
    /// on a table, so the floor is about 0.65 m below it.
    pub head_m: DVec3,
    /// Where the person faces, horizontal part used. Default -x, towards the arm.
    pub facing: DVec3,
    /// Tip of the index finger at rest, m. Default (0.95, 0.15, 0.72): half raised, on the
    /// right.
    pub hand_rest_m: DVec3,
    /// How the hand is held.
    pub gesture: Gesture,
    /// Length of the hand, wrist to middle fingertip, m. Default 0.17 to 0.205.
    pub hand_length_m: [f64; 2],
    /// A person's mean duration of a reach, s. Default 0.6 to 1.2; single reaches scatter by 10 %.
    pub mean_reach_s: [f64; 2],
    /// Largest sideways deviation from the straight way, share of its length. Default 0.01 to 0.05.
    pub curvature: [f64; 2],
    /// How far beyond the surface the fingertip wants to go, m. Default 0.008 to 0.02: with
    /// 500 N/m that is 4 to 10 N.
    pub press_depth_m: [f64; 2],
    /// How long it stays there, s. Default 0.5 to 1.
    pub hold_s: [f64; 2],
    /// Rest before the gaze leaves for the next target, s. Default 0.5 to 1.2.
    pub pause_s: [f64; 2],
    /// Mean time from the gaze leaving to the hand starting, s. Default 0.3; scatters by 15 %.
    pub gaze_lead_s: f64,
    /// Deviation of the gaze from the target, constant while it rests there, sd in each of two
    /// directions, rad. Default 1 degree.
    pub gaze_offset_rad: f64,
    /// Noise of the eye tracker on every sample, sd in each of two directions, rad. Default 0.5
    /// degrees.
    pub gaze_noise_rad: f64,
    /// Amplitude of the tremor of the hand, m. Default 0.0003, at frequencies from 8 to 12 Hz.
    pub tremor_m: f64,
    /// Noise of the tracker on palm, fingertips and head, sd per axis, m. Default 0.0007.
    pub tracker_noise_m: f64,
}

impl Default for PersonConfig {
    fn default() -> Self {
        Self {
            head_m: DVec3::new(1.3, 0.0, 1.0),
            facing: DVec3::NEG_X,
            hand_rest_m: DVec3::new(0.95, 0.15, 0.72),
            gesture: Gesture::Pointing,
            hand_length_m: [0.17, 0.205],
            mean_reach_s: [0.6, 1.2],
            curvature: [0.01, 0.05],
            press_depth_m: [0.008, 0.02],
            hold_s: [0.5, 1.0],
            pause_s: [0.5, 1.2],
            gaze_lead_s: 0.3,
            gaze_offset_rad: 1_f64.to_radians(),
            gaze_noise_rad: 0.5_f64.to_radians(),
            tremor_m: 0.0003,
            tracker_noise_m: 0.0007,
        }
    }
}

impl PersonConfig {
    fn validate(&self) -> Result<(), SimError> {
        finite("head_m", &self.head_m.to_array())?;
        finite("facing", &self.facing.to_array())?;
        finite("hand_rest_m", &self.hand_rest_m.to_array())?;
        positive("horizontal part of facing", self.facing.truncate().length())?;
        range("hand_length_m", self.hand_length_m)?;
        range("mean_reach_s", self.mean_reach_s)?;
        range("press_depth_m", self.press_depth_m)?;
        range("hold_s", self.hold_s)?;
        range("pause_s", self.pause_s)?;
        positive("gaze_lead_s", self.gaze_lead_s)?;
        not_negative("gaze_offset_rad", self.gaze_offset_rad)?;
        not_negative("gaze_noise_rad", self.gaze_noise_rad)?;
        not_negative("tremor_m", self.tremor_m)?;
        not_negative("tracker_noise_m", self.tracker_noise_m)?;
        not_negative("curvature", self.curvature[0])?;
        if !(self.curvature[0] <= self.curvature[1] && self.curvature[1] <= 0.5) {
            let (what, value) = ("curvature", self.curvature[1]);
            return Err(SimError::Parameter {
                what,
                value,
                wanted: "at least the lower end and at most 0.5",
            });
        }
        // Else the tremor alone could carry the tip back through the surface.
        if self.press_depth_m[0] < 2.0 * self.tremor_m {
            let (what, value) = ("press_depth_m", self.press_depth_m[0]);
            return Err(SimError::Parameter {
                what,
                value,
                wanted: "at least twice the tremor",
            });
        }
        Ok(())
    }
}

/// A person with habits of their own: hand size, pace, bow of the reach, tremor.
///
/// Everything follows from the configuration and the seed. A right-handed person who stands
/// still; the length of the arm does not limit the reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    config: PersonConfig,
    seed: u64,
    habits: Habits,
}

/// What one person keeps from touch to touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Habits {
    pub(crate) hand_length_m: f64,
    mean_reach_s: f64,
    /// Direction of the bow along the surface, rad, and its size.
    bow_direction_rad: f64,
    curvature: f64,
    /// Per axis: frequency, Hz, and phase, rad.
    pub(crate) tremor: [[f64; 2]; 3],
}

impl Person {
    /// Draws a person.
    ///
    /// # Errors
    /// NaN, infinity, a reversed range, or a setting outside its range.
    pub fn new(config: PersonConfig, seed: u64) -> Result<Self, SimError> {
        config.validate()?;
        let mut draw = Draw(Pcg64::seed_from_u64(seed));
        let habits = Habits {
            hand_length_m: draw.within(config.hand_length_m),
            mean_reach_s: draw.within(config.mean_reach_s),
            bow_direction_rad: draw.within([0.0, TAU]),
            curvature: draw.within(config.curvature),
            tremor: [(); 3].map(|()| [draw.within([8.0, 12.0]), draw.within([0.0, TAU])]),
        };
        Ok(Self {
            config,
            seed,
            habits,
        })
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &PersonConfig {
        &self.config
    }

    /// Mean duration of this person's reaches, from the start to the full depth, s.
    #[must_use]
    pub const fn mean_reach_s(&self) -> f64 {
        self.habits.mean_reach_s
    }

    /// Length of this person's hand, wrist to middle fingertip, m.
    #[must_use]
    pub const fn hand_length_m(&self) -> f64 {
        self.habits.hand_length_m
    }

    /// The shoulder of the reaching arm, base frame, m: 0.30 m below and 0.20 m to the right of
    /// the eyes, an assumption.
    #[must_use]
    pub fn shoulder_m(&self) -> DVec3 {
        self.config.head_m + self.forward().cross(DVec3::Z) * 0.20 - DVec3::Z * 0.30
    }

    /// Plans touches one after the other, each from rest and back to rest. The same plan gives
    /// the same sequence, to the last bit.
    ///
    /// # Errors
    /// NaN or infinity, a normal without direction, or a surface that the resting fingertip is
    /// not at least 20 mm in front of.
    pub fn plan(&self, touches: &[TouchPlan]) -> Result<TouchSequence, SimError> {
        // Another stream than that of the habits.
        let mut draw = Draw(Pcg64::seed_from_u64(self.seed ^ 0x9E37_79B9_7F4A_7C15));
        let mut rest_from_s = 0.0;
        let mut planned = Vec::with_capacity(touches.len());
        for (index, plan) in touches.iter().enumerate() {
            let touch = self.plan_touch(plan, index, rest_from_s, &mut draw)?;
            rest_from_s = touch.timeline.end_s;
            planned.push(touch);
        }
        Ok(TouchSequence::new(
            &self.config,
            self.habits,
            self.seed,
            self.forward(),
            planned,
        ))
    }

    fn plan_touch(
        &self,
        plan: &TouchPlan,
        index: usize,
        rest_from_s: f64,
        draw: &mut Draw,
    ) -> Result<Touch, SimError> {
        let c = &self.config;
        let h = &self.habits;
        let look_s = rest_from_s + draw.within(c.pause_s);
        let start_s = look_s + c.gaze_lead_s * draw.scatter(0.15);
        let press_s = start_s + h.mean_reach_s * draw.scatter(0.1);
        let withdraw_s = press_s + draw.within(c.hold_s);
        let end_s = withdraw_s + h.mean_reach_s * draw.scatter(0.1);
        let depth_m = draw.within(c.press_depth_m);
        let (sin, cos) = (h.bow_direction_rad + 0.5 * draw.normal()).sin_cos();
        let path = ReachPath::new(
            plan,
            index,
            c.hand_rest_m,
            depth_m,
            [cos, sin].map(|x| x * h.curvature),
        )?;
        let to_target = (plan.target_m - self.shoulder_m()).normalize_or(-path.normal());
        Ok(Touch {
            path,
            timeline: Timeline {
                look_s,
                start_s,
                press_s,
                withdraw_s,
                end_s,
            },
            depth_m,
            target_m: plan.target_m,
            // Between the line of the arm and straight into the surface.
            fingers: (to_target - path.normal()).normalize_or(-path.normal()),
            gaze_offset_rad: [draw.normal(), draw.normal()].map(|x| x * c.gaze_offset_rad),
        })
    }

    fn forward(&self) -> DVec3 {
        self.config.facing.truncate().normalize().extend(0.0)
    }
}

/// The kinds of random numbers used here.
struct Draw(Pcg64);

impl Draw {
    fn within(&mut self, [lo, hi]: [f64; 2]) -> f64 {
        lo + (hi - lo) * self.0.random::<f64>()
    }

    fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Factor about 1 with this relative scatter, at most three times it away.
    fn scatter(&mut self, sd: f64) -> f64 {
        (sd * self.normal().clamp(-3.0, 3.0)).exp()
    }
}

fn range(what: &'static str, [lo, hi]: [f64; 2]) -> Result<(), SimError> {
    positive(what, lo)?;
    positive(what, hi)?;
    if lo > hi {
        return Err(SimError::Parameter {
            what,
            value: hi,
            wanted: "at least the lower end of its range",
        });
    }
    Ok(())
}
