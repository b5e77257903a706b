//! The gaze: a fixation, a saccade, or lost.

use crate::frame::GazeRay;
use hwall_geometry::Pose;

/// The gaze at one time; the answer of a [`GazeFilter`](super::GazeFilter).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Gaze {
    /// No line of sight: no eye tracker, or a longer gap than is bridged.
    #[default]
    Lost,
    /// A saccade is under way, or has landed too recently to estimate the target.
    InFlight {
        /// Start of the saccade, s; the first sample if there was no fixation before.
        since_s: f64,
    },
    /// A fixation.
    Fixed(Fixation),
}

/// A fixation, with its line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixation {
    /// The mean line of sight: through the mean head position, along the mean direction. For a fixation on a point during head motion, this line
    /// passes through that point; each single line does so only at its own time.
    pub ray: GazeRay,
    /// Landing time, s.
    pub since_s: f64,
    /// Time of its newest sample, s. It stays behind while samples are missing.
    pub until_s: f64,
    /// Number of samples, including those that the mean has forgotten.
    pub samples: u32,
    /// Standard deviation of the mean direction from tracker noise alone, in each of two directions, rad. Errors of calibration and aim are
    /// constant during a fixation and not included.
    pub noise_rad: f64,
}

impl Fixation {
    /// A raw line of sight, for callers without a filter: one sample without noise.
    #[must_use]
    pub const fn of_ray(since_s: f64, t_s: f64, ray: GazeRay) -> Self {
        Self {
            ray,
            since_s,
            until_s: t_s,
            samples: 1,
            noise_rad: 0.0,
        }
    }

    /// Age of the fixation at a time, s; not negative.
    #[must_use]
    pub fn age_s(&self, t_s: f64) -> f64 {
        (t_s - self.since_s).max(0.0)
    }

    /// The same fixation in another frame; its times are unchanged.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self {
            ray: self.ray.transformed(a_from_b),
            ..*self
        }
    }

    /// Are all numbers finite and the direction a unit vector?
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.ray.origin_m.is_finite()
            && self.ray.direction.is_finite()
            && self.ray.direction.is_normalized()
            && self.since_s.is_finite()
            && self.until_s.is_finite()
            && self.noise_rad.is_finite()
    }
}

impl Gaze {
    /// The fixation; `None` during a saccade and while the gaze is lost.
    #[must_use]
    pub const fn fixation(&self) -> Option<&Fixation> {
        match self {
            Self::Fixed(fixation) => Some(fixation),
            Self::Lost | Self::InFlight { .. } => None,
        }
    }

    /// The mean line of sight of the fixation; `None` during a saccade and while the gaze is lost.
    #[must_use]
    pub fn ray(&self) -> Option<&GazeRay> {
        self.fixation().map(|fixation| &fixation.ray)
    }

    /// The same gaze in another frame.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        match self {
            Self::Fixed(fixation) => Self::Fixed(fixation.transformed(a_from_b)),
            other => *other,
        }
    }
}
