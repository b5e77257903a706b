//! Limits of printers and devices.

use crate::error::Result;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// A way to print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PrintProcess {
    /// Fused deposition modelling: a molten strand.
    Fdm,
    /// Stereolithography: resin hardened by light.
    Sla,
    /// Material jetting (PolyJet): drops of resin.
    PolyJet,
}

impl PrintProcess {
    /// Typical limits of the process.
    ///
    /// Sources: design rules of two printing services, read in 2026: Protolabs Network ("3D printing design rules": clearance,
    /// smallest feature, tolerance) and Fathom ("Additive technologies design guidelines": the same, and layer thickness). Where
    /// they differ, the more conservative value is used. The least height of three layers is this crate's own rule.
    #[must_use]
    pub const fn limits(self) -> ProcessLimits {
        let (gap, breadth, layer, tolerance) = match self {
            Self::Fdm => (0.5, 2.0, 0.25, 0.3),
            Self::Sla => (0.5, 0.5, 0.1, 0.2),
            Self::PolyJet => (0.4, 0.5, 0.03, 0.2),
        };
        ProcessLimits {
            least_gap_mm: gap,
            least_radius_mm: 0.5 * breadth,
            least_height_mm: 3.0 * layer,
            tolerance_mm: tolerance,
        }
    }
}

/// Limits of a printer that matter for bumps, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProcessLimits {
    /// Smallest gap that stays open.
    pub least_gap_mm: f64,
    /// Smallest radius of a bump.
    pub least_radius_mm: f64,
    /// Smallest height of a bump.
    pub least_height_mm: f64,
    /// Largest error of a breadth.
    pub tolerance_mm: f64,
}

impl ProcessLimits {
    pub(super) fn validate(&self) -> Result<()> {
        positive("least_gap_mm", self.least_gap_mm)?;
        positive("least_radius_mm", self.least_radius_mm)?;
        positive("least_height_mm", self.least_height_mm)?;
        non_negative("tolerance_mm", self.tolerance_mm)?;
        Ok(())
    }
}

/// Range and accuracy of the device that moves the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceLimits {
    /// Angles between scan and long axis of the bumps, degrees, within 0 to 90; default all of them.
    pub angle_deg: [f64; 2],
    /// Speeds of the board against the scan, mm/s; default 10 to 80. A resting finger on a resting board feels nothing.
    pub speed_mm_per_s: [f64; 2],
    /// Speed of the finger itself, mm/s; default 0 (at rest).
    pub finger_mm_per_s: f64,
    /// Largest error of the angle, degrees; default 1.
    pub angle_error_deg: f64,
    /// Largest error of the speed, relative; default 0.05, the error of the board's speed 60 ms after a touch.
    pub speed_error: f64,
}

impl Default for DeviceLimits {
    fn default() -> Self {
        Self {
            angle_deg: [0.0, 90.0],
            speed_mm_per_s: [10.0, 80.0],
            finger_mm_per_s: 0.0,
            angle_error_deg: 1.0,
            speed_error: 0.05,
        }
    }
}

impl DeviceLimits {
    pub(super) fn validate(&self) -> Result<()> {
        let [low, high] = self.angle_deg;
        let holds = 0.0 <= low && low <= high && high <= 90.0;
        that(holds, "angle_deg", low, "a range within 0 to 90")?;
        let [low, high] = self.speed_mm_per_s;
        let holds = 0.0 <= low && low <= high && high <= 1e4;
        that(holds, "speed_mm_per_s", low, "a range within 0 to 1e4")?;
        non_negative("finger_mm_per_s", self.finger_mm_per_s)?;
        let finger = finite("finger_mm_per_s", self.finger_mm_per_s)?;
        that(finger <= 1e4, "finger_mm_per_s", finger, "at most 1e4")?;
        let error = self.angle_error_deg;
        that(
            (0.0..=45.0).contains(&error),
            "angle_error_deg",
            error,
            "0 to 45",
        )?;
        let error = self.speed_error;
        that((0.0..1.0).contains(&error), "speed_error", error, "0 to 1")?;
        Ok(())
    }
}
