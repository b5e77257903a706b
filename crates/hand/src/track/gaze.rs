//! Where a person looks: at one place, on the way to another, or unknown.

use crate::frame::GazeRay;
use hwall_geometry::Pose;

/// What is known of the gaze at one time; the answer of a [`GazeFilter`](super::GazeFilter).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Gaze {
    /// No line of sight: no eye tracker, or none for longer than is bridged.
    #[default]
    Lost,
    /// The eye is on its way to another place, or has landed too recently to say where.
    InFlight {
        /// When it left, s; the first sample where nothing was known before.
        since_s: f64,
    },
    /// The eye rests.
    Fixed(Fixation),
}

/// A place that the eye rests on, seen along one line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixation {
    /// The mean line of sight: through the mean place of the head, along the mean direction. For an eye that rests on
    /// a point while the head moves, this line passes that point; each single line does so only at its own time.
    pub ray: GazeRay,
    /// When the eye landed, s.
    pub since_s: f64,
    /// Time of the newest sample in it, s. It stays behind while samples are missing.
    pub until_s: f64,
    /// Samples in it, older ones included that the mean has forgotten.
    pub samples: u32,
    /// Standard deviation of the mean direction by the noise of the tracker alone, in each of two directions, rad. The
    /// calibration of the tracker and the person's aim are constant during a fixation and come on top.
    pub noise_rad: f64,
}

impl Fixation {
    /// A line of sight taken as it is, for callers without a filter: one sample without noise.
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

    /// How long the eye has rested there at a time, s; not negative.
    #[must_use]
    pub fn age_s(&self, t_s: f64) -> f64 {
        (t_s - self.since_s).max(0.0)
    }

    /// The same fixation in another frame, its times as they are.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self {
            ray: self.ray.transformed(a_from_b),
            ..*self
        }
    }

    /// All numbers are finite and the direction is a unit vector.
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
    /// The fixation; `None` in flight and while the gaze is lost.
    #[must_use]
    pub const fn fixation(&self) -> Option<&Fixation> {
        match self {
            Self::Fixed(fixation) => Some(fixation),
            Self::Lost | Self::InFlight { .. } => None,
        }
    }

    /// The mean line of sight of the fixation; `None` in flight and while the gaze is lost.
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
