//! A calibration, and its file.

use glam::{DVec2, DVec3};
use hwall::geometry::Pose;
use hwall::hand::{HandError, MAX_COORDINATE_M, PointPair, RigidFit};
use serde::{Deserialize, Serialize};

/// Largest root mean square residual of a fit at the corners, m. Headsets locate a fingertip within about 11 mm \[Abdlkarim 2024\].
pub const FIT_BOUND_M: f64 = 0.015;
/// Bound, m, on the distance of a check touch from its corner, and on the difference between two such errors: each touch may have the error
/// that a fit allows. On a board of 0.2 m, this detects a rotation of the space by more than 6 degrees.
pub const CHECK_BOUND_M: f64 = 0.02;
/// Least distance between two corners, m: three times the accuracy of a touch.
const CLOSEST_M: f64 = 0.05;

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
    /// Two touches, or two corners of the board, are too close to each other.
    #[error(
        "touches {} and {} are {:.0} mm apart, their corners {:.0} mm: touch one corner after the other; corners must be at least {:.0} mm apart",
        pair[0] + 1, pair[1] + 1, 1e3 * touches_m, 1e3 * corners_m, 1e3 * CLOSEST_M
    )]
    Close {
        /// The two, from 0.
        pair: [usize; 2],
        /// Distance of the touches, m.
        touches_m: f64,
        /// Distance of the corners, m.
        corners_m: f64,
    },
    /// The touches do not determine a transform.
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
    /// The touches imply that the person stands behind the board.
    #[error(
        "left and right are exchanged: touch the corners in the order that the page shows, as you see them before the board"
    )]
    Behind,
}

/// The pose of a headset's space in the arm's base frame, from three touched corners of the board. It belongs to one headset.
///
/// Both frames know the vertical, so only heading and place are fitted: four unknowns from nine coordinates. The other five degrees of
/// freedom show how well it fits.
///
/// The touching point is the tip of the index finger as tracked by the headset. A constant offset of the tip along the finger therefore
/// becomes part of the pose, and does not count twice.
///
/// Error: exact for exact touches, if the arm's base and the headset's gravity are level. Touches with errors `e` move the middle of the
/// board by `e / √3`. On a board of 0.2 m they turn the heading by about `e / 0.16 m`, which adds an error of `e` for every 0.16 m away
/// from the board. [`turn_rad`](Self::turn_rad) estimates that turn. Source: [`RigidFit::level_from_pairs`], \[Horn 1987\].
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    headset: u64,
    pairs: [PointPair; 3],
    fit: RigidFit,
}

/// The file: the touches, from which the pose follows.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    version: u32,
    headset: u64,
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
const VERSION: u32 = 2;

/// Rejects pairs of touches, or of corners, that are too close to each other.
pub(super) fn apart(pairs: &[PointPair]) -> Result<(), CalibrationError> {
    for (second, b) in pairs.iter().enumerate() {
        for (first, a) in pairs.iter().enumerate().take(second) {
            let corners_m = a.in_a_m.distance(b.in_a_m);
            let touches_m = a.in_b_m.distance(b.in_b_m);
            if !(corners_m >= CLOSEST_M && touches_m >= 0.5 * corners_m) {
                let pair = [first, second];
                return Err(CalibrationError::Close {
                    pair,
                    touches_m,
                    corners_m,
                });
            }
        }
    }
    Ok(())
}

/// The pose of the headset's space, z up, in the base frame.
pub(super) fn level(pairs: &[PointPair]) -> Result<RigidFit, HandError> {
    let z_up: Vec<_> = pairs
        .iter()
        .map(|pair| PointPair {
            in_b_m: Pose::Z_UP_FROM_Y_UP.transform_point(pair.in_b_m),
            ..*pair
        })
        .collect();
    RigidFit::level_from_pairs(&z_up)
}

impl Calibration {
    /// The calibration of the headset with this id, from corners of the board: `a` in the arm's base frame, `b` as touched, in the
    /// headset's space with WebXR's axes (y up).
    ///
    /// # Errors
    /// Touches that do not fit the corners within [`FIT_BOUND_M`], that are too close to each other, that do not determine a transform, or
    /// that are not finite.
    pub fn from_touches(headset: u64, pairs: [PointPair; 3]) -> Result<Self, CalibrationError> {
        let is_near = |m: DVec3| m.abs().max_element() <= MAX_COORDINATE_M;
        // NaN fails this comparison.
        if !pairs.iter().all(|p| {
            let all = [p.in_a_m, p.in_b_m];
            all.iter().all(|m| m.is_finite() && is_near(*m))
        }) {
            return Err(CalibrationError::Range);
        }
        apart(&pairs)?;
        let fit = level(&pairs)?;
        let (rms_m, worst) = (fit.rms_m(), fit.worst());
        if rms_m > FIT_BOUND_M {
            return Err(CalibrationError::Misfit { rms_m, worst });
        }
        Ok(Self {
            headset,
            pairs,
            fit,
        })
    }

    /// The id of its headset.
    #[must_use]
    pub const fn headset(&self) -> u64 {
        self.headset
    }

    /// Pose of the headset's space, once its axes are z up, in the base frame: as [`BridgeConfig::base_from_headset`](crate::BridgeConfig::base_from_headset).
    #[must_use]
    pub fn base_from_headset(&self) -> Pose {
        self.fit.a_from_b
    }

    /// Converts a place in the headset's space (WebXR's axes) to the base frame, m.
    #[must_use]
    pub fn place_m(&self, there_m: DVec3) -> DVec3 {
        let z_up_m = Pose::Z_UP_FROM_Y_UP.transform_point(there_m);
        self.fit.a_from_b.transform_point(z_up_m)
    }

    /// From each corner to where it was touched, base axes, m.
    #[must_use]
    pub fn errors_m(&self) -> [DVec3; 3] {
        self.pairs
            .map(|pair| self.place_m(pair.in_b_m) - pair.in_a_m)
    }

    /// Root mean square residual at the corners, m.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        self.fit.rms_m()
    }

    /// Standard error of the heading, rad, estimated from the residuals at the corners.
    #[must_use]
    pub fn turn_rad(&self) -> f64 {
        let corners = self.pairs.map(|pair| pair.in_a_m.truncate());
        let mean = corners.iter().sum::<DVec2>() / 3.0;
        let extent: f64 = corners.iter().map(|at| at.distance_squared(mean)).sum();
        // Nine coordinates, less the four that were fitted.
        let variance = 3.0 * self.rms_m() * self.rms_m() / 5.0;
        (variance / extent).sqrt()
    }

    /// From a file's text.
    ///
    /// # Errors
    /// A text that is not a calibration; touches that do not determine one.
    pub fn from_json(text: &str) -> Result<Self, CalibrationError> {
        let reason = |reason: String| CalibrationError::File { reason };
        let read: Text = serde_json::from_str(text).map_err(|e| reason(e.to_string()))?;
        if read.version != VERSION {
            let version = read.version;
            return Err(reason(format!("version {version}, expected {VERSION}")));
        }
        let pairs = read.corners.map(|corner| PointPair {
            in_a_m: corner.base_m.into(),
            in_b_m: corner.headset_m.into(),
        });
        Self::from_touches(read.headset, pairs)
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
            headset: self.headset,
            corners,
        };
        // Numbers always have a JSON form.
        serde_json::to_string_pretty(&text).unwrap_or_default()
    }
}
