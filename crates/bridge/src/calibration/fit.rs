//! A calibration, and its file.

use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::{HandError, MAX_COORDINATE_M, PointPair, RigidFit};
use serde::{Deserialize, Serialize};

/// Largest root mean square of what a fit leaves at the corners, m. Headsets find a fingertip within some 11 mm \[Abdlkarim 2024\].
pub const FIT_BOUND_M: f64 = 0.015;
/// Largest distance of a check touch from its corner, m: two touches that are each off by what a fit may be.
pub const CHECK_BOUND_M: f64 = 0.02;
/// Largest angle between the two verticals, rad (10 degrees). Touches that are off by 15 mm on a board of 0.2 m tilt it by about 6 degrees, corners
/// in the wrong order by 90 degrees.
pub const TILT_BOUND_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Why touches, or a file, give no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// The file is not a calibration.
    #[error("not a calibration: {reason}")]
    File {
        /// What is wrong with it.
        reason: String,
    },
    /// A coordinate is not finite or too large.
    #[error("a coordinate of a corner or a touch is not a number or beyond {MAX_COORDINATE_M} m")]
    Range,
    /// The touches determine no transform.
    #[error("touch three different corners: {0}")]
    Points(#[from] HandError),
    /// The distances between the touches are not those between the corners.
    #[error(
        "the touches are {:.0} mm off the corners of the board (root mean square), at most {:.0} mm are allowed, and corner {} is worst; touch the corners in the order that the page shows",
        1e3 * rms_m, 1e3 * FIT_BOUND_M, worst + 1
    )]
    Misfit {
        /// Root mean square of the residuals, m.
        rms_m: f64,
        /// The corner with the largest residual, from 0.
        worst: usize,
    },
    /// The headset's vertical is not the arm's.
    #[error(
        "up in the headset is {:.0} degrees off up at the arm, at most {:.0} are allowed; touch the corners in the order that the page shows, on the face of the board",
        tilt_rad.to_degrees(), TILT_BOUND_RAD.to_degrees()
    )]
    Tilted {
        /// Angle between the two, rad.
        tilt_rad: f64,
    },
}

/// The pose of a headset's space in the arm's base frame, from three touched corners of the board.
///
/// What is touched is the tip of the index finger as the headset knows it, so a constant offset of the tip along the person's finger is part of the
/// pose, and does not count twice.
///
/// Error: exact for exact touches. Touches that are each off by `e` move the middle of the board by `e / √3`; a board of 0.2 m turns by about
/// `e / 0.14 m`, which adds as much again for every 0.14 m away from the board. Source: [`RigidFit`], \[Horn 1987\].
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    pairs: [PointPair; 3],
    fit: RigidFit,
}

/// The file: the touches, from which the pose follows.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    version: u32,
    corners: [Corner; 3],
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Corner {
    /// In the arm's base frame.
    base_m: [f64; 3],
    /// In the headset's space, in WebXR's axes.
    headset_m: [f64; 3],
}

/// Version of the file.
const VERSION: u32 = 1;

impl Calibration {
    /// From corners of the board: a in the arm's base frame, b as touched, in the headset's space with WebXR's axes (y up).
    ///
    /// # Errors
    /// Touches that do not fit the corners within [`FIT_BOUND_M`], that turn the vertical by more than [`TILT_BOUND_RAD`], that determine no
    /// transform, or that are no numbers.
    pub fn from_touches(pairs: [PointPair; 3]) -> Result<Self, CalibrationError> {
        let is_near = |m: DVec3| m.abs().max_element() <= MAX_COORDINATE_M;
        // NaN is not near.
        if !pairs.iter().all(|p| {
            let all = [p.in_a_m, p.in_b_m];
            all.iter().all(|m| m.is_finite() && is_near(*m))
        }) {
            return Err(CalibrationError::Range);
        }
        let fit = RigidFit::from_pairs(&pairs)?;
        let (rms_m, worst) = (fit.rms_m(), fit.worst());
        if rms_m > FIT_BOUND_M {
            return Err(CalibrationError::Misfit { rms_m, worst });
        }
        let up = fit.a_from_b.transform_vector(DVec3::Y);
        let tilt_rad = up.angle_between(DVec3::Z);
        if tilt_rad > TILT_BOUND_RAD {
            return Err(CalibrationError::Tilted { tilt_rad });
        }
        Ok(Self { pairs, fit })
    }

    /// Pose of the headset's space, once its axes are z up, in the base frame: as [`BridgeConfig::base_from_headset`](crate::BridgeConfig::base_from_headset).
    #[must_use]
    pub fn base_from_headset(&self) -> Pose {
        self.fit.a_from_b * Pose::Z_UP_FROM_Y_UP.inverse()
    }

    /// From each corner to where it was touched, base axes, m.
    #[must_use]
    pub fn errors_m(&self) -> [DVec3; 3] {
        self.pairs
            .map(|pair| self.fit.a_from_b.transform_point(pair.in_b_m) - pair.in_a_m)
    }

    /// Root mean square of what remains at the corners, m.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        self.fit.rms_m()
    }

    /// Distance of a touch (WebXR's axes) from its corner (base frame), m.
    #[must_use]
    pub fn off_m(&self, corner_m: DVec3, touched_m: DVec3) -> f64 {
        self.fit
            .a_from_b
            .transform_point(touched_m)
            .distance(corner_m)
    }

    /// From a file's text.
    ///
    /// # Errors
    /// A text that is not a calibration; touches that determine none.
    pub fn from_json(text: &str) -> Result<Self, CalibrationError> {
        let reason = |reason: String| CalibrationError::File { reason };
        let read: Text = serde_json::from_str(text).map_err(|e| reason(e.to_string()))?;
        if read.version != VERSION {
            let version = read.version;
            return Err(reason(format!("version {version}, expected {VERSION}")));
        }
        Self::from_touches(read.corners.map(|corner| PointPair {
            in_a_m: corner.base_m.into(),
            in_b_m: corner.headset_m.into(),
        }))
    }

    /// The text of its file.
    #[must_use]
    pub fn to_json(&self) -> String {
        let corners = self.pairs.map(|pair| Corner {
            base_m: pair.in_a_m.to_array(),
            headset_m: pair.in_b_m.to_array(),
        });
        let text = Text {
            version: VERSION,
            corners,
        };
        // Numbers always have a JSON form.
        serde_json::to_string_pretty(&text).unwrap_or_default()
    }
}
