//! How far off the estimates of held-out reaches are, and how well they say how sure they are.

use crate::contact::candidates::Role;
use crate::contact::moments::{Moment, Span};
use glam::DVec3;
use hwall_bip::EndPrediction;
use hwall_contact::ContactEstimate;
use hwall_hand::LabelledReach;
use hwall_testkit::quantile;

/// A region about the mean of a normal distribution in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Probability within it.
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
/// Half widths of the intervals of 50 % and 90 % of a normal distribution, deviations.
const INTERVALS: [f64; 2] = [0.674_489_750_196, 1.644_853_626_951];

/// How sure an estimate is of its point, and how far off it is in that measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation of each axis, m.
    pub sd_m: DVec3,
    /// Square of the distance from the true contact, in standard deviations.
    pub distance_squared: f64,
}

/// How far off an estimate of the time to contact is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeError {
    /// Estimated minus true time, s.
    pub error_s: f64,
    /// The standard deviation that was stated, s.
    pub sd_s: Option<f64>,
}

/// How far off one estimate of one reach is.
#[derive(Debug, Clone, Copy)]
pub struct EstimateError {
    /// Predicted minus true contact, m.
    pub error_m: DVec3,
    /// Does a board of 0.2 m, centred on the prediction, miss the hand? Along the surface where its normal
    /// is known; else: are the two more than 0.1 m apart?
    pub missed: bool,
    /// Where the estimate states a covariance.
    pub spread: Option<Spread>,
    /// Where it states a time to contact.
    pub time: Option<TimeError>,
}

impl EstimateError {
    pub(super) fn new(reach: &LabelledReach, frame: usize, estimate: &ContactEstimate) -> Self {
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
            missed: missed(error_m, reach.normal),
            spread,
            time: estimate.time_to_contact_s.map(|left| TimeError {
                error_s: left.mean_s - left_s,
                sd_s: left.sd_s,
            }),
        }
    }

    /// Mean over the axes of the continuous ranked probability score, m; without a covariance it is the
    /// absolute error.
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
        };
        (0..3).map(|axis| prediction.crps(axis)).sum::<f64>() / 3.0
    }
}

/// The last frame by a moment; `None` in a reach that starts later.
pub(super) fn frame_at(reach: &LabelledReach, moment: Moment) -> Option<usize> {
    moment.index(reach.frames.iter().map(|f| f.t_s), span(reach))
}

/// Start and contact of a reach.
pub(super) fn span(reach: &LabelledReach) -> Span {
    Span {
        start_s: reach.contact_s - reach.duration_s(),
        contact_s: reach.contact_s,
    }
}

/// Does a board of 0.2 m, upright and centred on the prediction, miss the hand: is the error along the
/// surface more than half of the board to a side or up? An error along the normal does not count: the arm
/// knows the surface's plane from the scene. Where the normal is unknown, so is the plane, and the whole
/// distance counts, which is the harder test.
fn missed(error_m: DVec3, normal: Option<DVec3>) -> bool {
    let Some(normal) = normal else {
        return error_m.length() > HALF_BOARD_M;
    };
    let across = DVec3::Z.cross(normal).try_normalize().unwrap_or(DVec3::X);
    let along = normal.cross(across);
    error_m.dot(across).abs() > HALF_BOARD_M || error_m.dot(along).abs() > HALF_BOARD_M
}

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// What it is compared as.
    pub role: Role,
    /// At every moment of [`Moment::all`], for every reach that is that long; `None` where there was no
    /// estimate.
    pub errors: Vec<Vec<Option<EstimateError>>>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
}

/// Averages over the reaches at one moment, or over several.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Estimates.
    pub count: usize,
    /// Reaches without an estimate.
    pub silent: usize,
    /// Median distance, m.
    pub median_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// Mean error of each axis, m.
    pub axis_mean_m: DVec3,
    /// Largest error of each axis, m.
    pub axis_max_m: DVec3,
    /// Boards missed.
    pub missed: usize,
    /// Share of the 50 % and 90 % intervals per axis that hold the truth.
    pub intervals: Option<[f64; 2]>,
    /// Share of the regions of [`REGIONS`] that hold the truth.
    pub regions: Option<[f64; REGIONS.len()]>,
    /// Mean continuous ranked probability score per axis, m.
    pub crps_m: f64,
    /// Mean error of the time to contact, s.
    pub time_mean_s: Option<f64>,
    /// Share of its 90 % intervals that hold the truth.
    pub time_interval: Option<f64>,
}

impl Scores {
    /// Over the reaches at the chosen moments together.
    #[must_use]
    pub fn at(&self, moments: impl Fn(Moment) -> bool) -> Summary {
        let chosen = Moment::all().zip(&self.errors).filter(|(m, _)| moments(*m));
        let (mut all, mut silent) = (Vec::new(), 0);
        for error in chosen.flat_map(|(_, errors)| errors) {
            match error {
                Some(error) => all.push(*error),
                None => silent += 1,
            }
        }
        let n = all.len() as f64;
        let mean = |value: &dyn Fn(&EstimateError) -> f64| all.iter().map(value).sum::<f64>() / n;
        let mut distances: Vec<f64> = all.iter().map(|j| j.error_m.length()).collect();
        distances.sort_by(f64::total_cmp);
        let axes = |j: &EstimateError| j.error_m.abs();
        let share = |hits: usize, of: usize| (of > 0).then(|| hits as f64 / of as f64);
        let spreads: Vec<(DVec3, Spread)> = all
            .iter()
            .filter_map(|j| j.spread.map(|spread| (j.error_m.abs(), spread)))
            .collect();
        let within = |deviations: f64| {
            let hits = |(e, spread): &(DVec3, Spread)| {
                (0..3)
                    .filter(|&i| e[i] <= deviations * spread.sd_m[i])
                    .count()
            };
            share(spreads.iter().map(hits).sum(), 3 * spreads.len())
        };
        let regions = REGIONS.map(|region| {
            let inside = |s: &&(DVec3, Spread)| s.1.distance_squared <= region.radius_squared;
            let hits = spreads.iter().filter(inside).count();
            hits as f64 / spreads.len() as f64
        });
        let times: Vec<f64> = all
            .iter()
            .filter_map(|j| j.time.map(|t| t.error_s.abs()))
            .collect();
        let timed: Vec<(f64, f64)> = all
            .iter()
            .filter_map(|j| j.time.and_then(|t| Some((t.error_s.abs(), t.sd_s?))))
            .collect();
        let in_time = timed
            .iter()
            .filter(|(e, sd)| *e <= INTERVALS[1] * sd)
            .count();
        Summary {
            count: all.len(),
            silent,
            median_m: quantile(&distances, 0.5),
            mean_m: mean(&|j| j.error_m.length()),
            axis_mean_m: all.iter().map(axes).sum::<DVec3>() / n,
            axis_max_m: all.iter().map(axes).fold(DVec3::ZERO, DVec3::max),
            missed: all.iter().filter(|j| j.missed).count(),
            intervals: within(INTERVALS[0])
                .zip(within(INTERVALS[1]))
                .map(|(a, b)| [a, b]),
            regions: (!spreads.is_empty()).then_some(regions),
            crps_m: mean(&EstimateError::crps_m),
            time_mean_s: (!times.is_empty())
                .then(|| times.iter().sum::<f64>() / times.len() as f64),
            time_interval: share(in_time, timed.len()),
        }
    }

    /// Over the reaches at one moment.
    #[must_use]
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.at(|m| m == moment)
    }

    /// Over 30 to 90 % of the time, while an estimate is still of use.
    #[must_use]
    pub fn under_way(&self) -> Summary {
        self.at(|m| matches!(m, Moment::Share(share) if share < 0.95))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::{HandFrame, HandPoint};

    fn reach() -> LabelledReach {
        let frame = |k: usize| {
            let mut frame = HandFrame::empty(k as f64 * 0.01);
            frame.set_point(HandPoint::Index, Some(DVec3::splat(frame.t_s)));
            frame
        };
        LabelledReach {
            person: None,
            trial: None,
            point: HandPoint::Index,
            frames: (0..=100).map(frame).collect(),
            contact_m: DVec3::ONE,
            contact_s: 1.0,
            normal: Some(DVec3::X),
        }
    }

    #[test]
    fn a_board_is_missed_along_it_not_across_it() {
        let missed = |off_m: DVec3, normal| missed(off_m, normal);
        assert!(!missed(DVec3::new(0.3, 0.09, -0.09), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.11, 0.0), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.0, 0.11), Some(-DVec3::X)));
        // A table top: both directions along it are level.
        assert!(!missed(DVec3::new(0.0, 0.0, 0.5), Some(DVec3::Z)));
        // The surface is unknown: the distance counts.
        assert!(missed(DVec3::new(0.08, 0.08, 0.0), None));
        assert!(!missed(DVec3::new(0.06, 0.06, 0.0), None));
    }

    #[test]
    fn reaches_that_start_later_are_not_judged_earlier() {
        let mut short = reach();
        short.frames.drain(..80);
        assert_eq!(frame_at(&short, Moment::Before(0.3)), None);
        assert_eq!(frame_at(&short, Moment::Before(0.1)), Some(10));
        assert_eq!(frame_at(&short, Moment::Share(1.0)), Some(20));
    }

    #[test]
    fn regions_are_those_of_three_dimensions() {
        // Distribution of the squared radius: chi square with three degrees of freedom.
        let mut sampler = hwall_testkit::Sampler::new(1);
        let n = 200_000;
        let squares: Vec<f64> = (0..n)
            .map(|_| (0..3).map(|_| sampler.normal().powi(2)).sum())
            .collect();
        for Region {
            probability,
            radius_squared,
        } in REGIONS
        {
            let within =
                squares.iter().filter(|s| **s <= radius_squared).count() as f64 / f64::from(n);
            assert!(
                (within - probability).abs() < 5e-3,
                "{probability}: {within}"
            );
        }
    }
}
