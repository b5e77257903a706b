//! A simulated person: habits drawn once from a seed.

use super::config::PersonConfig;
use super::draw::Draw;
use super::gaze::deflected;
use super::gesture::{Gesture, Hand};
use crate::error::SimError;
use glam::DVec3;
use std::f64::consts::TAU;

/// Streams of random numbers. Those of the nominal person are separate, so that other traits do not change them.
const PLAIN_HABITS: u64 = 0;
const HABITS: u64 = 0xD1B5_4A32_D192_ED03;
const SHAPES: u64 = 0x3C6E_F372_FE94_F82B;

/// How far a hand takes the shape of its gesture, an assumption.
const SHAPE_TAKEN: [f64; 2] = [0.5, 1.0];

/// A person with individual habits: hand and gesture, speed, speed profile, bow of the reach, posture, gaze, tremor.
///
/// Determined by the configuration and the seed. Right-handed, stays in place; the arm length does not limit the reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    config: PersonConfig,
    seed: u64,
    habits: Habits,
}

/// Habits that a person keeps from touch to touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Habits {
    pub(super) hand: Hand,
    pub(super) mean_reach_s: f64,
    /// Direction of the bow along the surface, rad, and its magnitude.
    pub(super) bow_direction_rad: f64,
    pub(super) curvature: f64,
    pub(super) speed_peak: f64,
    pub(super) undershoot: f64,
    pub(super) posture_rad: [f64; 2],
    pub(super) head_m: DVec3,
    pub(super) lean_m: f64,
    pub(super) gaze_lead_s: f64,
    pub(super) tremor_m: f64,
    /// Per axis: frequency, Hz, and phase, rad.
    pub(super) tremor: [[f64; 2]; 3],
}

impl Person {
    /// Draws a person. For several people see [`Population`](crate::Population).
    ///
    /// # Errors
    /// As [`PersonConfig::validate`].
    pub fn new(config: PersonConfig, seed: u64) -> Result<Self, SimError> {
        config.validate()?;
        Ok(Self::drawn(config, seed))
    }

    /// Draws a person from a valid configuration.
    pub(super) fn drawn(config: PersonConfig, seed: u64) -> Self {
        let (mut plain, mut draw) = (Draw::new(seed, PLAIN_HABITS), Draw::new(seed, HABITS));
        let length_m = plain.within(config.hand_length_m);
        let any = Gesture::ALL[draw.index(Gesture::ALL.len())];
        let habits = Habits {
            hand: Hand {
                gesture: config.gesture.unwrap_or(any),
                length_m,
                open_by: draw.within([0.6, 0.95]),
                takes_shape: (config.takes_shape)
                    .then(|| Draw::new(seed, SHAPES).within(SHAPE_TAKEN)),
            },
            mean_reach_s: plain.within(config.mean_reach_s),
            bow_direction_rad: plain.within([0.0, TAU]),
            curvature: plain.within(config.curvature),
            speed_peak: draw.within(config.speed_peak),
            undershoot: draw.within(config.undershoot),
            posture_rad: [(); 2].map(|()| draw.bounded() * config.posture_rad),
            head_m: config.head_m + scattered(&mut draw, config.head_scatter_m),
            lean_m: draw.within(config.lean_m),
            gaze_lead_s: draw.within(config.gaze_lead_s),
            tremor_m: draw.within(config.tremor_m),
            tremor: [(); 3].map(|()| [plain.within([8.0, 12.0]), plain.within([0.0, TAU])]),
        };
        Self {
            config,
            seed,
            habits,
        }
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &PersonConfig {
        &self.config
    }

    /// This person's gesture.
    #[must_use]
    pub const fn gesture(&self) -> Gesture {
        self.habits.hand.gesture
    }

    /// Mean duration of this person's reaches over [`PersonConfig::REFERENCE_M`], from start to full depth, s.
    #[must_use]
    pub const fn mean_reach_s(&self) -> f64 {
        self.habits.mean_reach_s
    }

    /// Length of this person's hand, wrist to middle fingertip, m.
    #[must_use]
    pub const fn hand_length_m(&self) -> f64 {
        self.habits.hand.length_m
    }

    /// Fraction of the movement time at which this person's speed peaks.
    #[must_use]
    pub const fn speed_peak(&self) -> f64 {
        self.habits.speed_peak
    }

    /// Point between this person's eyes at rest, base frame, m.
    #[must_use]
    pub const fn head_m(&self) -> DVec3 {
        self.habits.head_m
    }

    /// The shoulder of the reaching arm, base frame, m: 0.30 m below and 0.20 m to the right of
    /// the eyes, an assumption.
    #[must_use]
    pub fn shoulder_m(&self) -> DVec3 {
        self.head_m() + self.forward().cross(DVec3::Z) * 0.20 - DVec3::Z * 0.30
    }

    pub(super) fn forward(&self) -> DVec3 {
        self.config.facing.truncate().normalize().extend(0.0)
    }

    /// Direction of the fingers at rest.
    pub(super) fn fingers_at_rest(&self) -> DVec3 {
        let plain = (self.forward() - DVec3::Z * 0.3).normalize();
        deflected(plain, self.habits.posture_rad)
    }

    pub(super) const fn habits(&self) -> &Habits {
        &self.habits
    }

    pub(super) const fn seed(&self) -> u64 {
        self.seed
    }
}

pub(super) fn scattered(draw: &mut Draw, sd_m: f64) -> DVec3 {
    sd_m * DVec3::new(draw.bounded(), draw.bounded(), draw.bounded())
}
