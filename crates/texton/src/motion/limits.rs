//! Limits of the motion of a board.

use super::scan_estimate::ScanConfig;
use crate::error::Result;
use hwall_numeric::check::{non_negative, positive};

/// Limits of the motion of a board, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Largest speed in contact, m/s; default 0.1. Faster levels are presented at this speed.
    pub speed_m_per_s: f64,
    /// Largest acceleration, m/s²; default 4: 80 mm/s after 20 ms.
    pub acceleration_m_per_s2: f64,
    /// Largest displacement of the board since the touch, m; default 0.08.
    pub stroke_m: f64,
    /// Half of the textured face along the board's x and y axes, m; default 0.1.
    pub half_face_m: [f64; 2],
    /// Least distance of the finger's middle from the edge of the face, m; default 0.01.
    pub margin_m: f64,
    /// Fastest turn in contact, rad/s; default 0.5, felt as 25 mm/s by a finger 50 mm off the middle.
    pub turn_rad_per_s: f64,
    /// Fastest change of the turn, rad/s²; default 4.
    pub turn_rad_per_s2: f64,
    /// Return speed out of contact, m/s; default 0.25.
    pub return_speed_m_per_s: f64,
    /// Upper bound of the time step, s; default 0.05.
    pub max_step_s: f64,
    /// Estimation of the scan direction.
    pub scan: ScanConfig,
}

impl Default for MotionLimits {
    fn default() -> Self {
        Self {
            speed_m_per_s: 0.1,
            acceleration_m_per_s2: 4.0,
            stroke_m: 0.08,
            half_face_m: [0.1; 2],
            margin_m: 0.01,
            turn_rad_per_s: 0.5,
            turn_rad_per_s2: 4.0,
            return_speed_m_per_s: 0.25,
            max_step_s: 0.05,
            scan: ScanConfig::default(),
        }
    }
}

impl MotionLimits {
    /// Rejects settings that are not positive, and a margin that covers the whole face.
    ///
    /// # Errors
    /// The first such setting, or NaN.
    pub fn validate(&self) -> Result<()> {
        positive("speed_m_per_s", self.speed_m_per_s)?;
        positive("acceleration_m_per_s2", self.acceleration_m_per_s2)?;
        positive("stroke_m", self.stroke_m)?;
        for half_m in self.half_face_m {
            positive("half_face_m", half_m)?;
            positive("half_face_m less margin_m", half_m - self.margin_m)?;
        }
        non_negative("margin_m", self.margin_m)?;
        positive("turn_rad_per_s", self.turn_rad_per_s)?;
        positive("turn_rad_per_s2", self.turn_rad_per_s2)?;
        positive("return_speed_m_per_s", self.return_speed_m_per_s)?;
        positive("max_step_s", self.max_step_s)?;
        self.scan.validate()
    }
}
