//! Soft regions of the progress of a reach.

use crate::learned::reaches::reach_track::PROGRESS;

/// Width of a region, in mean squared distances of samples from their centres. Wider regions share more samples, so they need fewer reaches.
const OVERLAP: f64 = 4.0;
/// Regions with less than this share of the nearest one's weight are ignored.
const NEGLIGIBLE: f64 = 1e-3;
/// Largest number of samples in the search for centres.
const MOST_SAMPLES: usize = 6000;
/// Largest number of iterations of the search for centres; it usually converges much earlier.
const ROUNDS: usize = 25;

/// Overlapping regions in the space of progress; their weights sum to 1.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Gates {
    /// Inverse standard deviation of every scalar over the training samples.
    pub(in crate::learned) scale: [f64; PROGRESS],
    pub(in crate::learned) centres: Vec<[f64; PROGRESS]>,
    /// Twice the square of the width of a region, in scaled units.
    pub(in crate::learned) width: f64,
}

impl Gates {
    /// At most `count` regions over these samples, by k-means from initial points far from each other: deterministic.
    pub(in crate::learned) fn of(samples: &[[f64; PROGRESS]], count: usize) -> Self {
        let n = samples.len().max(1) as f64;
        let scale = std::array::from_fn(|k| {
            let mean = samples.iter().map(|s| s[k]).sum::<f64>() / n;
            let squares: f64 = samples.iter().map(|s| (s[k] - mean).powi(2)).sum();
            1.0 / (squares / n).sqrt().max(1e-6)
        });
        let step = samples.len().div_ceil(MOST_SAMPLES).max(1);
        let some = samples.iter().step_by(step);
        let scaled: Vec<[f64; PROGRESS]> = some.map(|s| times(s, &scale)).collect();
        let n = scaled.len().max(1) as f64;
        let mut centres = spread_out(&scaled, count);
        for _ in 0..ROUNDS {
            let mut sums = vec![([0.0; PROGRESS], 0.0); centres.len()];
            for s in &scaled {
                let (sum, weight) = &mut sums[nearest(s, &centres).0];
                sum.iter_mut().zip(s).for_each(|(a, b)| *a += b);
                *weight += 1.0;
            }
            let before = centres.clone();
            for (centre, (sum, weight)) in centres.iter_mut().zip(sums) {
                if weight > 0.0 {
                    *centre = sum.map(|x| x / weight);
                }
            }
            if centres == before {
                break;
            }
        }
        let spread = scaled.iter().map(|s| nearest(s, &centres).1).sum::<f64>() / n;
        Self {
            scale,
            centres,
            width: (OVERLAP * spread).max(1e-9),
        }
    }

    pub(in crate::learned) fn len(&self) -> usize {
        self.centres.len()
    }

    /// The weights of the regions at a progress.
    pub(in crate::learned) fn weights_into(&self, progress: &[f64; PROGRESS], out: &mut Vec<f64>) {
        let at = times(progress, &self.scale);
        out.clear();
        out.extend(self.centres.iter().map(|c| squared(&at, c)));
        // Relative to the nearest one: otherwise all weights would vanish far from all regions.
        let least = out.iter().copied().fold(f64::INFINITY, f64::min);
        let mut sum = 0.0;
        for w in out.iter_mut() {
            *w = ((least - *w) / self.width).exp();
            // Sparse weights save time in training and prediction.
            *w = if *w > NEGLIGIBLE { *w } else { 0.0 };
            sum += *w;
        }
        out.iter_mut().for_each(|w| *w /= sum);
    }
}

fn times(a: &[f64; PROGRESS], b: &[f64; PROGRESS]) -> [f64; PROGRESS] {
    std::array::from_fn(|k| a[k] * b[k])
}

fn squared(a: &[f64; PROGRESS], b: &[f64; PROGRESS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// The nearest centre and the squared distance to it.
fn nearest(s: &[f64; PROGRESS], centres: &[[f64; PROGRESS]]) -> (usize, f64) {
    let distances = centres.iter().map(|c| squared(s, c)).enumerate();
    distances
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, 0.0))
}

/// Samples, each the furthest from those before; fewer than `count` if samples coincide.
fn spread_out(samples: &[[f64; PROGRESS]], count: usize) -> Vec<[f64; PROGRESS]> {
    let mut centres: Vec<[f64; PROGRESS]> = samples.first().copied().into_iter().collect();
    // Squared distance to the nearest centre so far.
    let mut distances = vec![f64::INFINITY; samples.len()];
    while centres.len() < count {
        let Some(newest) = centres.last() else {
            break;
        };
        for (distance, s) in distances.iter_mut().zip(samples) {
            *distance = distance.min(squared(s, newest));
        }
        let furthest = distances
            .iter()
            .zip(samples)
            .max_by(|a, b| a.0.total_cmp(b.0));
        match furthest {
            Some((distance, s)) if *distance > 0.0 => centres.push(*s),
            _ => break,
        }
    }
    centres
}
