//! A texture with levels that present the wanted roughnesses.

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
    /// Angle and speed.
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
    /// Predicted magnitude at this angle and speed.
    pub magnitude: f64,
    /// Expected just noticeable difference, in magnitude.
    pub jnd: f64,
    /// `jnd` as a turn at this speed, degrees; `None` above 90 degrees.
    pub jnd_deg: Option<f64>,
    /// `jnd` as a change of speed at this angle, mm/s; `None` above 1e4 mm/s.
    pub jnd_mm_per_s: Option<f64>,
    /// Error of the magnitude in just noticeable differences: root sum of squares of the effects of the largest errors
    /// of angle, speed (device) and breadth (printer).
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

/// A printable texture with a level for every wanted roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignCandidate {
    /// Bump and grid.
    pub texture: Texture,
    /// What its levels vary.
    pub path: LevelPath,
    /// A level for each wanted roughness, in the order given.
    pub levels: Vec<DesignLevel>,
    /// Smallest distance between two levels, in just noticeable differences; `None` for one level.
    pub least_step_jnd: Option<f64>,
    /// Largest `error_jnd` of the levels.
    pub worst_error_jnd: f64,
    /// What was given up, and why.
    pub given_up: Vec<GivenUp>,
}
