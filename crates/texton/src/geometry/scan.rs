//! The direction in which a finger crosses a texture.

use crate::error::Result;
use hwall_numeric::check::finite;
use std::f64::consts::{FRAC_PI_2, PI};

/// Angle between the scan and the long axis of the bumps (θ of the dissertation), folded into
/// 0 to 90 degrees: both grids are symmetric under reflection, so other directions feel the same.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct ScanAngle {
    rad: f64,
    cos: f64,
    sin: f64,
}

impl ScanAngle {
    /// Along the long axis.
    pub const ALONG: Self = Self {
        rad: 0.0,
        cos: 1.0,
        sin: 0.0,
    };

    /// Along the short axis.
    pub const ACROSS: Self = Self {
        rad: FRAC_PI_2,
        cos: 0.0,
        sin: 1.0,
    };

    /// From radians; any finite angle.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_rad(theta_rad: f64) -> Result<Self> {
        finite("theta_rad", theta_rad)?;
        let half_turn = theta_rad.abs() % PI;
        let rad = half_turn.min(PI - half_turn);
        // `ACROSS` has a cosine of exactly 0; the cosine of the rounded angle is not 0.
        if rad == FRAC_PI_2 {
            return Ok(Self::ACROSS);
        }
        let (sin, cos) = rad.sin_cos();
        Ok(Self { rad, cos, sin })
    }

    /// From degrees; 0 and 90 are exact.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_deg(theta_deg: f64) -> Result<Self> {
        finite("theta_deg", theta_deg)?;
        let half_turn = theta_deg.abs() % 180.0;
        let deg = half_turn.min(180.0 - half_turn);
        if deg == 90.0 {
            return Ok(Self::ACROSS);
        }
        Self::from_rad(deg.to_radians())
    }

    /// The angle, rad, from 0 to π/2.
    #[must_use]
    pub const fn rad(self) -> f64 {
        self.rad
    }

    /// The angle, degrees, from 0 to 90.
    #[must_use]
    pub fn deg(self) -> f64 {
        self.rad.to_degrees()
    }

    /// Its cosine: component of the scan along the long axis.
    #[must_use]
    pub const fn cos(self) -> f64 {
        self.cos
    }

    /// Its sine: component along the short axis.
    #[must_use]
    pub const fn sin(self) -> f64 {
        self.sin
    }
}
