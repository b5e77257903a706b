//! Ridge regression of where a hand ends, with its own leave-one-out covariance.

use crate::bip::baselines::Seen;
use crate::bip::recordings::{Reaches, point};
use anyhow::ensure;
use glam::DVec3;
use hwall_bip::Demonstration;

/// How far back positions are looked up, s.
const LAGS_S: [f64; 3] = [0.03, 0.06, 0.12];
/// Displacements of the past are scaled to this much time.
const HORIZON_S: f64 = 0.2;
/// Lowest standard deviation of an end, m.
const SENSOR_M: f64 = 1e-4;
/// Square of the constant feature, as a multiple of the others: next to free of the ridge.
const INTERCEPT: f64 = 1e3;
/// Fewest reaches to learn from.
const FEWEST: usize = 10;
/// Candidates for the ridge, as shares of the mean of the features' squared lengths.
const RIDGES: [f64; 9] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0];

/// An end point with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndEstimate {
    /// Where the hand ends, m.
    pub mean_m: DVec3,
    /// Covariance of the error on held-out reaches, row-major, m².
    pub covariance_m2: [f64; 9],
}

/// How a motion goes at one sample, as far as was seen.
#[derive(Debug, Clone, Copy)]
struct Progress {
    elapsed_s: f64,
    speed_m_per_s: f64,
    /// Speed over the largest speed so far.
    of_peak: f64,
    gone_m: f64,
}

/// Reaches to compare with where they had gone as far as this one.
#[derive(Debug, Clone)]
pub struct EndRegression<'a> {
    demonstrations: &'a [Demonstration],
    progress: Vec<Vec<Progress>>,
    /// Spread of progress over all samples of all reaches.
    spread: Progress,
    scored: usize,
}

impl<'a> EndRegression<'a> {
    /// Of the reaches of a set, or of some of them.
    ///
    /// # Errors
    /// Fewer than ten reaches.
    pub fn new(set: &Reaches, demonstrations: &'a [Demonstration]) -> anyhow::Result<Self> {
        ensure!(
            demonstrations.len() >= FEWEST,
            "{} reaches are too few for a regression",
            demonstrations.len()
        );
        let progress: Vec<Vec<Progress>> = demonstrations
            .iter()
            .map(|d| progress(d, set.scored, d.len() - 1))
            .collect();
        let sd = |value: fn(&Progress) -> f64| {
            let values: Vec<f64> = progress.iter().flatten().map(value).collect();
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            (squares / n).sqrt().max(1e-9)
        };
        Ok(Self {
            demonstrations,
            spread: Progress {
                elapsed_s: sd(|p| p.elapsed_s),
                speed_m_per_s: sd(|p| p.speed_m_per_s),
                of_peak: sd(|p| p.of_peak),
                gone_m: sd(|p| p.gone_m),
            },
            progress,
            scored: set.scored,
        })
    }

    fn distance(&self, a: &Progress, b: &Progress) -> f64 {
        let s = &self.spread;
        ((a.elapsed_s - b.elapsed_s) / s.elapsed_s).powi(2)
            + ((a.speed_m_per_s - b.speed_m_per_s) / s.speed_m_per_s).powi(2)
            + ((a.of_peak - b.of_peak) / s.of_peak).powi(2)
            + ((a.gone_m - b.gone_m) / s.gone_m).powi(2)
    }

    /// The end of a motion of which samples up to `last` were seen.
    ///
    /// Every known reach is taken at the sample where it went most like this motion goes now: time
    /// since the start, speed, speed over its peak, way gone. What was left of it there is linear in
    /// where the scored point started, where all points are as seen from there, and how far they went
    /// in the last 0.03, 0.06 and 0.12 s. The ridge is the one with the least leave-one-out error.
    #[must_use]
    pub fn predict(&self, motion: &Demonstration, last: usize) -> EndEstimate {
        let now = progress(motion, self.scored, last)[last];
        let (mut features, mut left_m) = (Vec::new(), Vec::new());
        for (d, progress) in self.demonstrations.iter().zip(&self.progress) {
            let away = |k: &usize| self.distance(&now, &progress[*k]);
            let nearest = (0..progress.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
            let at = nearest.unwrap_or(0);
            features.push(self.features(d, at));
            left_m.push(point(d, d.len() - 1, self.scored) - point(d, at, self.scored));
        }
        let fit = ridge(features, &left_m, self.features(motion, last));
        let mut covariance_m2 = [0.0; 9];
        for (at, c) in covariance_m2.iter_mut().enumerate() {
            let (i, j) = (at / 3, at % 3);
            let products: f64 = fit.errors.iter().map(|e| e[i] * e[j]).sum();
            *c = products / fit.errors.len() as f64;
            if i == j {
                *c += SENSOR_M * SENSOR_M;
            }
        }
        EndEstimate {
            mean_m: point(motion, last, self.scored) + fit.value,
            covariance_m2,
        }
    }

    fn features(&self, d: &Demonstration, last: usize) -> Vec<f64> {
        let origin = point(d, 0, self.scored);
        let now = d.sample(last);
        let mut features = origin.to_array().to_vec();
        features.extend(now.iter().enumerate().map(|(dof, x)| x - origin[dof % 3]));
        for lag_s in LAGS_S {
            let then = before(d, d.times()[last] - lag_s);
            // Of the size of the displacements, so that the ridge treats both alike.
            features.extend(
                now.iter()
                    .zip(then)
                    .map(|(x, y)| (x - y) * HORIZON_S / lag_s),
            );
        }
        features
    }
}

/// A prediction, and what it would have missed each of the known targets by.
struct RidgeFit {
    value: DVec3,
    errors: Vec<DVec3>,
}

/// Ridge regression in its dual form (as many unknowns as examples); of the ridges the one with the least
/// leave-one-out error. With `α = (K + λ)⁻¹ y` that error is `α_i / ((K + λ)⁻¹)_ii` [Allen 1974].
fn ridge(mut features: Vec<Vec<f64>>, targets: &[DVec3], mut here: Vec<f64>) -> RidgeFit {
    let n = targets.len();
    let mean: Vec<f64> = (0..here.len())
        .map(|j| features.iter().map(|f| f[j]).sum::<f64>() / n as f64)
        .collect();
    for row in features.iter_mut().chain([&mut here]) {
        for (x, m) in row.iter_mut().zip(&mean) {
            *x -= m;
        }
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = features.iter().map(|f| dot(f, f)).sum::<f64>() / n as f64 + f64::MIN_POSITIVE;
    // The intercept has to be a feature: centring alone would make `K` singular, and the errors of a
    // small ridge then look far smaller than they are.
    let kernel = |a: &[f64], b: &[f64]| dot(a, b) / size + INTERCEPT;
    let gram: Vec<f64> = features
        .iter()
        .flat_map(|a| features.iter().map(|b| kernel(a, b)).collect::<Vec<_>>())
        .collect();
    let mut best: Option<(f64, RidgeFit)> = None;
    for ridge in RIDGES {
        let mut ridged = gram.clone();
        for i in 0..n {
            ridged[i * n + i] += ridge;
        }
        let Some(inverse) = inverse(n, ridged) else {
            continue;
        };
        let weights: Vec<DVec3> = inverse
            .chunks_exact(n)
            .map(|row| row.iter().zip(targets).map(|(a, y)| *a * *y).sum())
            .collect();
        let errors: Vec<DVec3> = (0..n).map(|i| weights[i] / inverse[i * n + i]).collect();
        let squares = errors.iter().map(|e| e.length_squared()).sum();
        if best.as_ref().is_none_or(|(least, _)| squares < *least) {
            let terms = features.iter().zip(&weights);
            let value = terms.map(|(f, w)| kernel(f, &here) * *w).sum();
            best = Some((squares, RidgeFit { value, errors }));
        }
    }
    // The largest ridge always has an inverse.
    best.map_or_else(
        || RidgeFit {
            value: DVec3::ZERO,
            errors: targets.to_vec(),
        },
        |(_, fit)| fit,
    )
}

fn progress(d: &Demonstration, scored: usize, last: usize) -> Vec<Progress> {
    let points: Vec<DVec3> = (0..=last).map(|k| point(d, k, scored)).collect();
    let mut peak = 1e-9_f64;
    (0..=last)
        .map(|k| {
            let seen = Seen {
                times_s: &d.times()[..=k],
                points_m: &points[..=k],
            };
            let speed_m_per_s = seen.velocity_m_per_s().length();
            peak = peak.max(speed_m_per_s);
            Progress {
                elapsed_s: d.times()[k] - d.times()[0],
                speed_m_per_s,
                of_peak: speed_m_per_s / peak,
                gone_m: points[k].distance(points[0]),
            }
        })
        .collect()
}

/// All degrees of freedom at a time stamp, on straight lines between samples; the first sample
/// before it.
fn before(d: &Demonstration, t_s: f64) -> Vec<f64> {
    let times = d.times();
    let next = times
        .partition_point(|x| *x < t_s)
        .clamp(1, times.len() - 1);
    let share = ((t_s - times[next - 1]) / (times[next] - times[next - 1])).clamp(0.0, 1.0);
    d.sample(next - 1)
        .iter()
        .zip(d.sample(next))
        .map(|(a, b)| a + share * (b - a))
        .collect()
}

/// Inverse of a symmetric positive-definite matrix; `None` if it is not. Gauss and Jordan without
/// pivoting, which such a matrix does not need.
fn inverse(n: usize, mut a: Vec<f64>) -> Option<Vec<f64>> {
    for k in 0..n {
        let pivot = a[k * n + k];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        let row: Vec<f64> = a[k * n..(k + 1) * n].to_vec();
        for i in (0..n).filter(|i| *i != k) {
            let factor = a[i * n + k] / pivot;
            for (x, r) in a[i * n..(i + 1) * n].iter_mut().zip(&row) {
                *x -= factor * r;
            }
            a[i * n + k] = -factor;
        }
        for x in &mut a[k * n..(k + 1) * n] {
            *x /= pivot;
        }
        a[k * n + k] = 1.0 / pivot;
    }
    Some(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_the_identity() {
        let a = vec![4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];
        let b = inverse(3, a.clone()).unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| a[3 * i + k] * b[3 * k + j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        assert!(inverse(2, vec![1.0, 2.0, 2.0, 1.0]).is_none());
    }

    #[test]
    fn leave_one_out_errors_are_those_of_leaving_out() {
        let mut sampler = hwall_testkit::Sampler::new(7);
        let features: Vec<Vec<f64>> = (0..12)
            .map(|_| (0..20).map(|_| sampler.normal()).collect())
            .collect();
        let targets: Vec<DVec3> = (0..12).map(|_| sampler.unit_vector()).collect();
        let all = ridge(features.clone(), &targets, features[3].clone());
        let (mut fewer, mut rest) = (features.clone(), targets.clone());
        let here = fewer.remove(3);
        let truth = rest.remove(3);
        let without = ridge(fewer, &rest, here);
        // Centre, scale and choice of the ridge change a little with what is left out.
        let difference = all.errors[3].distance(truth - without.value);
        assert!(difference < 0.15 * all.errors[3].length(), "{difference}");
    }

    #[test]
    fn an_end_that_is_linear_in_what_was_seen_is_found() {
        // Straight reaches anywhere in any direction, all of one length and one second: what is left
        // is a multiple of the present displacement.
        let mut sampler = hwall_testkit::Sampler::new(5);
        let mut reaches: Vec<Demonstration> = (0..21)
            .map(|_| {
                let from = sampler.point_in_box(DVec3::splat(-0.1), DVec3::splat(0.1));
                let way = 0.4 * sampler.unit_vector();
                let values = (0..=50).flat_map(|k| {
                    let share = crate::bip::baselines::minimum_jerk_share(f64::from(k) / 50.0);
                    (from + share * way).to_array()
                });
                Demonstration::from_samples(0.02, 3, values.collect()).unwrap()
            })
            .collect();
        let new = reaches.pop().unwrap();
        let set = Reaches {
            name: "made",
            source: String::new(),
            points: vec![hwall_hand::HandPoint::Index],
            scored: 0,
            demonstrations: reaches,
            left_out: Vec::new(),
        };
        let regression = EndRegression::new(&set, &set.demonstrations).unwrap();
        let estimate = regression.predict(&new, 20);
        assert!(estimate.mean_m.distance(point(&new, 50, 0)) < 1e-3);
        assert!((0..3).all(|i| estimate.covariance_m2[4 * i] < 1e-6));
    }
}
