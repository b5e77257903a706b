//! The pose of a tracker, from points measured in both frames.

use crate::error::HandError;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_numeric::check::all_finite;

/// One point, measured in two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointPair {
    /// In frame a, such as the robot's base, m.
    pub in_a_m: DVec3,
    /// In frame b, such as the tracker's, m.
    pub in_b_m: DVec3,
}

/// The rigid transform between two frames that best fits point pairs, with its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidFit {
    /// The transform, least squares over all pairs.
    pub a_from_b: Pose,
    /// Distance of each transformed point from its partner, m, in the order of the pairs.
    pub residuals_m: Vec<f64>,
}

/// Fewest pairs that determine a rigid transform if the vertical is known.
const FEWEST: usize = 2;
/// Points above each other leave the heading undetermined. Below this ratio of the extent that determines it to the extent of the points, they
/// count as above each other.
const COLLINEAR: f64 = 1e-9;

/// Means of the points in both frames, m.
fn means(pairs: &[PointPair]) -> Result<[DVec3; 2], HandError> {
    let got = pairs.len();
    if got < FEWEST {
        return Err(HandError::TooFewPairs {
            needed: FEWEST,
            got,
        });
    }
    for pair in pairs {
        all_finite("point in frame a", &pair.in_a_m.to_array())?;
        all_finite("point in frame b", &pair.in_b_m.to_array())?;
    }
    let n = got as f64;
    // Divide first: sums of large coordinates would overflow.
    Ok([
        pairs.iter().map(|p| p.in_a_m / n).sum(),
        pairs.iter().map(|p| p.in_b_m / n).sum(),
    ])
}

/// Largest distance of a coordinate from its mean, m.
fn size(pairs: &[PointPair], [mean_a, mean_b]: [DVec3; 2]) -> f64 {
    pairs.iter().fold(0.0, |m: f64, p| {
        m.max((p.in_a_m - mean_a).abs().max_element())
            .max((p.in_b_m - mean_b).abs().max_element())
    })
}

impl RigidFit {
    /// From points known in both frames, where z is up in both, so that only the heading and the place are searched. Two pairs suffice, unless one is
    /// above the other; more average noise out.
    ///
    /// Error: exact up to rounding for exact pairs; with independent noise of standard deviation `s` per coordinate, the mean of `n` points is off
    /// by `s √(3 / n)`, and the heading by `s / √(Σ r²)`, with `r` the horizontal distances of the points from their mean. Source: the least squares
    /// of \[Horn 1987\] for a rotation about z, whose angle is atan2(Σ b × a, Σ b · a) of the horizontal parts.
    ///
    /// # Errors
    /// NaN or infinity, fewer than two pairs, points above each other.
    pub fn level_from_pairs(pairs: &[PointPair]) -> Result<Self, HandError> {
        let [mean_a, mean_b] = means(pairs)?;
        let size = size(pairs, [mean_a, mean_b]);
        let (mut sine, mut cosine) = (0.0, 0.0);
        for pair in pairs {
            let a = (pair.in_a_m - mean_a).truncate() / size;
            let b = (pair.in_b_m - mean_b).truncate() / size;
            sine += b.perp_dot(a);
            cosine += b.dot(a);
        }
        let ratio = f64::hypot(sine, cosine);
        if ratio.is_nan() || ratio <= COLLINEAR {
            return Err(HandError::Collinear { ratio });
        }
        let rotation = DMat3::from_rotation_z(sine.atan2(cosine));
        Self::of(rotation, [mean_a, mean_b], pairs)
    }

    fn of(
        rotation: DMat3,
        [mean_a, mean_b]: [DVec3; 2],
        pairs: &[PointPair],
    ) -> Result<Self, HandError> {
        let a_from_b = Pose::new(rotation, mean_a - rotation * mean_b)?;
        let residuals_m = pairs
            .iter()
            .map(|p| a_from_b.transform_point(p.in_b_m).distance(p.in_a_m))
            .collect();
        Ok(Self {
            a_from_b,
            residuals_m,
        })
    }

    /// Root mean square of the residuals, m.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        let squares: f64 = self.residuals_m.iter().map(|r| r * r).sum();
        (squares / self.residuals_m.len() as f64).sqrt()
    }

    /// Index of the pair with the largest residual: check it first if the fit is bad.
    #[must_use]
    pub fn worst(&self) -> usize {
        let residuals = self.residuals_m.iter().enumerate();
        // `max_by` keeps the last of equals.
        residuals
            .rev()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map_or(0, |(pair, _)| pair)
    }
}
