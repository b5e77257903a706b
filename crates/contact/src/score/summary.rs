//! Statistics of errors over reaches.

use super::errors::{EstimateError, INTERVALS, REGIONS, Spread};
use glam::DVec3;

/// Statistics over the reaches at one moment, or over several.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Number of estimates.
    pub count: usize,
    /// Number of reaches without an estimate.
    pub silent: usize,
    /// Median distance, m.
    pub median_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// 90 % of the distances are at most this, m.
    pub p90_m: f64,
    /// Median distance along the surface, m, if the reaches have a normal.
    pub along_m: Option<f64>,
    /// Mean error of each axis, m.
    pub axis_mean_m: DVec3,
    /// Largest error of each axis, m.
    pub axis_max_m: DVec3,
    /// Number of missed boards.
    pub missed: usize,
    /// Coverage of the 50 % and 90 % intervals per axis.
    pub intervals: Option<[f64; 2]>,
    /// Coverage of the regions of [`REGIONS`].
    pub regions: Option<[f64; REGIONS.len()]>,
    /// Mean continuous ranked probability score per axis, m.
    pub crps_m: f64,
    /// Mean error of the time to contact, s.
    pub time_mean_s: Option<f64>,
    /// Coverage of its 90 % intervals.
    pub time_interval: Option<f64>,
}

impl Summary {
    /// Over estimates; `None` for a reach without one. Without any estimate the figures are NaN.
    #[must_use]
    pub fn of(errors: impl IntoIterator<Item = Option<EstimateError>>) -> Self {
        let (mut all, mut silent) = (Vec::new(), 0);
        for error in errors {
            match error {
                Some(error) => all.push(error),
                None => silent += 1,
            }
        }
        let n = all.len() as f64;
        let mean = |value: &dyn Fn(&EstimateError) -> f64| all.iter().map(value).sum::<f64>() / n;
        let mut distances: Vec<f64> = all.iter().map(|j| j.error_m.length()).collect();
        distances.sort_by(f64::total_cmp);
        let mut along: Vec<f64> = all.iter().filter_map(|j| j.along_m).collect();
        along.sort_by(f64::total_cmp);
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
            p90_m: quantile(&distances, 0.9),
            along_m: (!along.is_empty()).then(|| quantile(&along, 0.5)),
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

    /// Coverage of the 90 % regions; `None` without covariances.
    #[must_use]
    pub fn covered(&self) -> Option<f64> {
        let most = REGIONS.iter().position(|r| r.probability == 0.9)?;
        self.regions.map(|regions| regions[most])
    }
}

/// Quantile `p` of sorted values, interpolated linearly; NaN without values.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = p * last as f64;
    let (low, high) = (
        sorted[place.floor() as usize],
        sorted[place.ceil() as usize],
    );
    low + place.fract() * (high - low)
}
