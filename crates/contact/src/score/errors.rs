//! The error of one estimate of a reach, absolute and relative to its stated covariance.

use crate::estimate::ContactEstimate;
use glam::DVec3;
use hwall_bip::EndPrediction;
use hwall_hand::LabelledReach;

/// A region about the mean of a normal distribution in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Probability of the region.
    pub probability: f64,
    /// Square of its radius, in standard deviations.
    pub radius_squared: f64,
}

/// Regions of rising probability. Source: the chi-square distribution with three degrees of freedom.
pub const REGIONS: [Region; 10] = [
    region(0.1, 0.584_374),
    region(0.2, 1.005_174),
    region(0.3, 1.423_652),
    region(0.4, 1.869_168),
    region(0.5, 2.365_974),
    region(0.6, 2.946_166),
    region(0.7, 3.664_871),
    region(0.8, 4.641_628),
    region(0.9, 6.251_389),
    region(0.95, 7.814_728),
];

const fn region(probability: f64, radius_squared: f64) -> Region {
    Region {
        probability,
        radius_squared,
    }
}

/// Half of a board's edge, m.
const HALF_BOARD_M: f64 = 0.1;
/// Half widths of the 50 % and 90 % intervals of a normal distribution, in standard deviations.
pub(super) const INTERVALS: [f64; 2] = [0.674_489_750_196, 1.644_853_626_951];

/// The stated uncertainty of an estimate, and its normalised error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation of each axis, m.
    pub sd_m: DVec3,
    /// Squared Mahalanobis distance from the true contact.
    pub distance_squared: f64,
}

/// The error of a time to contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeError {
    /// Estimated minus true time, s.
    pub error_s: f64,
    /// The stated standard deviation, s.
    pub sd_s: Option<f64>,
}

/// The error of one estimate of one reach.
#[derive(Debug, Clone, Copy)]
pub struct EstimateError {
    /// Predicted minus true contact, m.
    pub error_m: DVec3,
    /// Length of the error along the surface, m; `None` if the normal is unknown.
    pub along_m: Option<f64>,
    /// Does a board of 0.2 m, centred on the prediction, miss the hand? Measured along the surface if its normal is known; otherwise the limit is a
    /// distance of 0.1 m.
    pub missed: bool,
    /// `None` if the estimate states no covariance.
    pub spread: Option<Spread>,
    /// `None` if the estimate states no time to contact.
    pub time: Option<TimeError>,
}

impl EstimateError {
    /// The error of the estimate at one frame of a reach.
    #[must_use]
    pub fn new(reach: &LabelledReach, frame: usize, estimate: &ContactEstimate) -> Self {
        let error_m = estimate.point_m - reach.contact_m;
        let left_s = reach.contact_s - reach.frames[frame].t_s;
        let spread = estimate.covariance_m2.map(|c| {
            let sd = DVec3::new(c.x_axis.x, c.y_axis.y, c.z_axis.z);
            Spread {
                sd_m: sd.map(f64::sqrt),
                distance_squared: error_m.dot(c.inverse() * error_m),
            }
        });
        Self {
            error_m,
            along_m: reach
                .normal
                .map(|n| error_m.reject_from_normalized(n).length()),
            missed: missed(error_m, reach.normal),
            spread,
            time: estimate.time_to_contact_s.map(|left| TimeError {
                error_s: left.mean_s - left_s,
                sd_s: left.sd_s,
            }),
        }
    }

    /// Continuous ranked probability score, mean over the axes, m; without a covariance the absolute error.
    #[must_use]
    pub fn crps_m(&self) -> f64 {
        let Some(Spread { sd_m, .. }) = self.spread else {
            return self.error_m.abs().element_sum() / 3.0;
        };
        let prediction = EndPrediction {
            motion: 0,
            fraction: 0.0,
            mean: self.error_m.to_array().to_vec(),
            sd: sd_m.to_array().to_vec(),
            actual: vec![0.0; 3],
            time: None,
        };
        (0..3).map(|axis| prediction.crps(axis)).sum::<f64>() / 3.0
    }
}

/// Does a board of 0.2 m, upright and centred on the prediction, miss the hand: is the error along the surface more than half of the board sideways
/// or up? An error along the normal does not count: the arm knows the plane from the scene. Without a normal the plane is unknown, and the full
/// distance counts, which is the stricter test.
fn missed(error_m: DVec3, normal: Option<DVec3>) -> bool {
    let Some(normal) = normal else {
        return error_m.length() > HALF_BOARD_M;
    };
    let across = DVec3::Z.cross(normal).try_normalize().unwrap_or(DVec3::X);
    let along = normal.cross(across);
    error_m.dot(across).abs() > HALF_BOARD_M || error_m.dot(along).abs() > HALF_BOARD_M
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_missed_along_it_not_across_it() {
        assert!(!missed(DVec3::new(0.3, 0.09, -0.09), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.11, 0.0), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.0, 0.11), Some(-DVec3::X)));
        // A table top: both directions along it are horizontal.
        assert!(!missed(DVec3::new(0.0, 0.0, 0.5), Some(DVec3::Z)));
        // Unknown surface: the distance counts.
        assert!(missed(DVec3::new(0.08, 0.08, 0.0), None));
        assert!(!missed(DVec3::new(0.06, 0.06, 0.0), None));
    }

    #[test]
    fn regions_are_those_of_three_dimensions() {
        // The squared radius follows a chi-square distribution with three degrees of freedom.
        let mut sampler = hwall_testkit::Sampler::new(1);
        let square = |_: u32| (0..3).map(|_| sampler.normal().powi(2)).sum();
        let squares: Vec<f64> = (0..200_000).map(square).collect();
        for region in REGIONS {
            let inside = squares.iter().filter(|s| **s <= region.radius_squared);
            let within = inside.count() as f64 / squares.len() as f64;
            assert!((within - region.probability).abs() < 5e-3, "{within}");
        }
    }
}
