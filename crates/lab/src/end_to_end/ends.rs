//! Errors of the presented face.

use hwall_contact::{ContactEstimate, ContactEstimator};
use hwall_stage::person::responses::Answered;

/// Shares of the time of a reach at which it is evaluated.
pub(super) const SHARES: [f64; 6] = [0.3, 0.5, 0.7, 0.8, 0.9, 1.0];

/// Error of the presented face against the demonstrated one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EndError {
    /// Distance of the middles, m.
    pub(super) middle_m: f64,
    /// Part of it along the normal, m.
    pub(super) gap_m: f64,
    /// Angle between the normals, rad; `None` from an estimator of points.
    pub(super) tilt_rad: Option<f64>,
    /// Is the demonstrated middle in the 90 % region? `None` without a covariance.
    pub(super) is_in_region: Option<bool>,
}

/// Squared Mahalanobis distance of the 90 % region in space.
const REGION_90: f64 = 6.251;

impl EndError {
    /// `turned`: is the estimate's normal part of the result?
    fn new(estimate: &ContactEstimate, turned: bool, answered: &Answered) -> Self {
        let wanted_m = answered.target.point_m;
        let off = estimate.point_m - wanted_m;
        let truth = answered.target.normal.normalize_or_zero();
        let normal = estimate.normal.filter(|_| turned);
        let away = estimate.distance_squared(wanted_m);
        Self {
            middle_m: off.length(),
            gap_m: off.dot(truth).abs(),
            tilt_rad: normal.map(|normal| normal.angle_between(truth)),
            is_in_region: away.map(|away| away <= REGION_90),
        }
    }
}

/// The errors of an estimator at each of the [`SHARES`].
pub(super) struct EndErrors {
    /// For tables.
    pub(super) name: String,
    /// At each share, the errors of all reaches with an estimate by then.
    pub(super) at: [Vec<EndError>; SHARES.len()],
}

impl EndErrors {
    /// Follows every reach. `turned`: is the estimate's normal part of the result?
    pub(super) fn follow<E: ContactEstimator>(
        name: impl Into<String>,
        estimator: &mut E,
        answered: &[Answered],
        turned: bool,
    ) -> Self {
        let mut at: [Vec<EndError>; SHARES.len()] = Default::default();
        for answered in answered {
            estimator.begin();
            let frames = &answered.reach.frames;
            let Some(first) = frames.first() else {
                continue;
            };
            let lasts_s = answered.reach.contact_s - first.t_s;
            let estimates = frames
                .iter()
                .map(|frame| (frame.t_s - first.t_s, estimator.step(frame)));
            let estimates: Vec<(f64, Option<ContactEstimate>)> = estimates.collect();
            for (share, errors) in SHARES.into_iter().zip(&mut at) {
                let by = estimates.partition_point(|(t_s, _)| *t_s <= share * lasts_s);
                let newest = by.checked_sub(1).and_then(|i| estimates[i].1);
                errors.extend(newest.map(|estimate| EndError::new(&estimate, turned, answered)));
            }
        }
        let name = name.into();
        Self { name, at }
    }
}
