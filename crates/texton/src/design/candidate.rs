//! A texture with the levels that present what is wanted.

use super::given_up::GivenUp;
use crate::geometry::{ScanAngle, Texture};
use crate::levels::Level;

/// Which of angle and speed a design varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LevelPath {
    /// The speed alone: the board need not turn between touches.
    Speed,
    /// The angle alone: all levels at one speed.
    Angle,
    /// Both.
    Both,
}

/// One wanted roughness, and how it is presented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DesignLevel {
    /// The roughness that was wanted, as it was given.
    pub wanted: f64,
    /// Angle between scan and long axis of the bumps.
    pub scan: ScanAngle,
    /// Speed of the board against the scan, mm/s.
    pub speed_mm_per_s: f64,
    /// Magnitude that is predicted there.
    pub magnitude: f64,
    /// Expected just noticeable difference, in magnitude.
    pub jnd: f64,
    /// The same as a turn at this speed, degrees; `None` where no turn of 90 degrees would do.
    pub jnd_deg: Option<f64>,
    /// The same as a change of speed at this angle, mm/s; `None` where the magnitude does not depend on it.
    pub jnd_mm_per_s: Option<f64>,
    /// Error of the magnitude from those of printer and device, in just noticeable differences: the root of the
    /// sum of squares of the largest errors of angle, speed and breadth.
    pub error_jnd: f64,
}

impl DesignLevel {
    /// As a level for a [`LevelTable`](crate::LevelTable).
    #[must_use]
    pub const fn level(&self) -> Level {
        Level {
            scan: self.scan,
            speed_mm_per_s: self.speed_mm_per_s,
            magnitude: self.magnitude,
        }
    }
}

/// A texture that can be printed, with a level for every roughness that was wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignCandidate {
    /// Bump and grid.
    pub texture: Texture,
    /// What its levels vary.
    pub path: LevelPath,
    /// A level for each wanted roughness, in the order given.
    pub levels: Vec<DesignLevel>,
    /// Distance of the nearest two levels, in just noticeable differences; `None` for one level.
    pub least_step_jnd: Option<f64>,
    /// Largest of the errors of the levels, in just noticeable differences.
    pub worst_error_jnd: f64,
    /// What was given up, and why.
    pub given_up: Vec<GivenUp>,
}
