//! Ridge regression of where a hand ends, with its own leave-one-out covariance.

use crate::bip_baselines::Seen;
use crate::bip_recordings::{Reaches, point};
use anyhow::ensure;
use glam::DVec3;
use hwall_bip::Demonstration;

/// How far back positions are looked up, s.
const LAGS_S: [f64; 4] = [0.0, 0.03, 0.06, 0.12];
/// A constant is a feature too, of this size: next to free of the ridge.
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

/// How a motion goes at one sample, as far as was seen, in the units of [`Progress::distance`].
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
        let w = weights();
        w[0] * ((a.elapsed_s - b.elapsed_s) / s.elapsed_s).powi(2)
            + w[1] * ((a.speed_m_per_s - b.speed_m_per_s) / s.speed_m_per_s).powi(2)
            + w[2] * ((a.of_peak - b.of_peak) / s.of_peak).powi(2)
            + w[3] * ((a.gone_m - b.gone_m) / s.gone_m).powi(2)
    }

    /// The end of a motion of which samples up to `last` were seen.
    #[must_use]
    pub fn predict(&self, motion: &Demonstration, last: usize) -> EndEstimate {
        let so_far = progress(motion, self.scored, last);
        let n = self.demonstrations.len();
        let nearest = |i: usize| {
            let away = |k: &usize| self.distance(&so_far[last], &self.progress[i][*k]);
            (0..self.progress[i].len())
                .min_by(|a, b| away(a).total_cmp(&away(b)))
                .unwrap_or(0)
        };
        let matches: Vec<usize> = (0..n).map(nearest).collect();
        let features: Vec<Vec<f64>> = (0..n)
            .map(|i| self.features(&self.demonstrations[i], matches[i]))
            .collect();
        let here = self.features(motion, last);
        let left: Vec<DVec3> = self
            .demonstrations
            .iter()
            .zip(&matches)
            .map(|(d, k)| point(d, d.len() - 1, self.scored) - point(d, *k, self.scored))
            .collect();

        // Centred features: the mean end belongs to the mean reach.
        let mean: Vec<f64> = (0..here.len())
            .map(|j| features.iter().map(|f| f[j]).sum::<f64>() / n as f64)
            .collect();
        let mean_left = left.iter().sum::<DVec3>() / n as f64;
        let centred = |f: &[f64]| -> Vec<f64> { f.iter().zip(&mean).map(|(a, b)| a - b).collect() };
        let rows: Vec<Vec<f64>> = features.iter().map(|f| centred(f)).collect();
        let here = centred(&here);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let size = rows.iter().map(|r| dot(r, r)).sum::<f64>() / n as f64;

        let mut best: Option<(f64, DVec3, Vec<DVec3>)> = None;
        for ridge in RIDGES {
            let mut gram = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] = dot(&rows[i], &rows[j]) + INTERCEPT * size;
                }
                gram[i * n + i] += ridge * size + f64::MIN_POSITIVE;
            }
            let Some(inverse) = inverse(n, gram) else {
                continue;
            };
            let weights: Vec<DVec3> = (0..n)
                .map(|i| {
                    (0..n)
                        .map(|j| inverse[i * n + j] * (left[j] - mean_left))
                        .sum()
                })
                .collect();
            // What the others say of each, in closed form.
            let errors: Vec<DVec3> = (0..n).map(|i| weights[i] / inverse[i * n + i]).collect();
            let squares = errors.iter().map(|e| e.length_squared()).sum::<f64>();
            if best.as_ref().is_none_or(|(least, ..)| squares < *least) {
                let end = mean_left
                    + (0..n)
                        .map(|i| (dot(&rows[i], &here) + INTERCEPT * size) * weights[i])
                        .sum::<DVec3>();
                best = Some((squares, end, errors));
            }
        }
        let (_, end, errors) = best.unwrap_or((0.0, mean_left, left.clone()));
        let mut covariance_m2 = [0.0; 9];
        for (at, c) in covariance_m2.iter_mut().enumerate() {
            let products = errors.iter().map(|e| e[at / 3] * e[at % 3]).sum::<f64>();
            *c = products / n as f64 + if at % 4 == 0 { 1e-8 } else { 0.0 };
        }
        EndEstimate {
            mean_m: point(motion, last, self.scored) + end,
            covariance_m2,
        }
    }

    fn features(&self, d: &Demonstration, last: usize) -> Vec<f64> {
        let origin = point(d, 0, self.scored);
        let t_s = d.times()[last] - d.times()[0];
        let mut features = origin.to_array().to_vec();
        let now = d.sample(last);
        for lag_s in LAGS_S {
            let then = after(d, (t_s - lag_s).max(0.0));
            for (dof, x) in then.iter().enumerate() {
                features.push(if lag_s == 0.0 {
                    x - origin[dof % 3]
                } else {
                    (now[dof] - x) * 0.2 / lag_s
                });
            }
        }
        features
    }
}
pub static W: std::sync::Mutex<[f64; 4]> = std::sync::Mutex::new([1.0; 4]);
fn weights() -> [f64; 4] {
    *W.lock().unwrap()
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

/// All degrees of freedom at a time since the start, s, on straight lines between samples.
fn after(d: &Demonstration, t_s: f64) -> Vec<f64> {
    let times = d.times();
    let t = times[0] + t_s;
    let next = times.partition_point(|x| *x < t).clamp(1, times.len() - 1);
    let share = ((t - times[next - 1]) / (times[next] - times[next - 1])).clamp(0.0, 1.0);
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
    fn an_end_that_is_linear_in_what_was_seen_is_found() {
        // Straight reaches with direction and length at random, all of one second: the end is a
        // multiple of the present displacement.
        let mut sampler = hwall_testkit::Sampler::new(5);
        let mut reaches: Vec<Demonstration> = (0..21)
            .map(|_| {
                let from = sampler.point_in_box(DVec3::splat(-0.1), DVec3::splat(0.1));
                let way = sampler.point_in_box(DVec3::splat(0.1), DVec3::splat(0.5));
                let values = (0..=50).flat_map(|k| {
                    let share = crate::bip_baselines::minimum_jerk_share(f64::from(k) / 50.0);
                    (from + share * way).to_array()
                });
                Demonstration::from_samples(0.02, 3, values.collect()).unwrap()
            })
            .collect();
        let new = reaches.pop().unwrap();
        let set = Reaches {
            name: "made",
            source: String::new(),
            points: vec![hwall_contact::HandPoint::Index],
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
