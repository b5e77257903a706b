//! The errors of the sources of an estimate on reaches that they were not learnt from, and how the sources are
//! combined by them.

use super::config::Combination;
use super::local_ridge::Rows;
use super::reach_track::way_axes;
use super::samples::TrainingSample;
use crate::outer_product::{outer, square};
use glam::{DMat3, DVec3};

/// Lowest standard deviation of a coordinate that is ever claimed, m: the noise of a good tracker.
pub(super) const SENSOR_M: f64 = 3e-4;
/// Lowest standard deviation of a time, s.
const CLOCK_S: f64 = 2e-3;
/// 90 % of a normal variable in three dimensions lie within this Mahalanobis distance, squared.
const CHI_SQUARED_3_90: f64 = 6.251_389;
/// 90 % of a standard normal variable lie within this.
const NORMAL_90: f64 = 1.644_854;
/// Larger errors are clipped to this many times the median: a primitive that loses its way on one
/// reach in a hundred is metres off and would outweigh all others.
const CLIP: f64 = 4.0;
/// Largest squared Mahalanobis distance that counts in a comparison of axes.
const FAR_OUT: f64 = 20.0;
/// If the sources are further apart than this many times the usual, one of them has lost its way.
const LOST: f64 = 3.0;

/// In which axes errors are alike from reach to reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axes {
    /// Along the way from start to end and across it: people miss along their way.
    Way,
    /// Those of the samples: along the normal of a wall, contacts that all lie on it are certain.
    World,
}

impl Axes {
    fn of(self, start_m: DVec3, end_m: DVec3) -> DMat3 {
        match self {
            Self::Way => way_axes(start_m, end_m),
            Self::World => DMat3::IDENTITY,
        }
    }
}

/// Held-out errors by region of progress, in the axes that describe them best.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeldOut {
    pub(super) axes: Axes,
    pub(super) regions: Vec<Errors>,
}

impl HeldOut {
    /// From what the sources predict for every sample when its fold is held out.
    pub(super) fn of(
        samples: &[TrainingSample],
        rows: &Rows,
        held_out: &[f64],
        combination: Combination,
    ) -> Self {
        let [way, world] = [Axes::Way, Axes::World]
            .map(|axes| Errors::by_region(samples, rows, held_out, combination, axes));
        // The more likely of the two; a tie goes to the axes that turn with the reach.
        if world.1 > way.1 {
            let (axes, regions) = (Axes::World, world.0);
            Self { axes, regions }
        } else {
            let (axes, regions) = (Axes::Way, way.0);
            Self { axes, regions }
        }
    }

    /// The errors at a progress.
    pub(super) fn at(&self, gates: &[f64]) -> Errors {
        Errors::at(&self.regions, gates)
    }

    /// The combination in the frame of the samples, with a covariance that is calibrated.
    pub(super) fn estimate(
        &self,
        errors: &Errors,
        combination: Combination,
        start_m: DVec3,
        regression_m: DVec3,
        primitive_m: Option<DVec3>,
    ) -> Combined {
        let Combined {
            point_m,
            moments_m2,
        } = errors.combined(combination, regression_m, primitive_m);
        let axes = self.axes.of(start_m, regression_m);
        let covariance = axes * (moments_m2 * errors.spread + sensor()) * axes.transpose();
        Combined {
            point_m,
            moments_m2: (covariance + covariance.transpose()) * 0.5,
        }
    }
}

/// A combination of the sources.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Combined {
    pub(super) point_m: DVec3,
    /// Second moments of its error, m².
    pub(super) moments_m2: DMat3,
}

/// Second moments of held-out errors in some axes, m² and s², in one region of progress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Errors {
    pub(super) regression: DMat3,
    pub(super) primitive: DMat3,
    /// `E[regression primitiveᵀ]`.
    pub(super) cross: DMat3,
    /// Share of the primitive in the combination.
    pub(super) gain: f64,
    pub(super) time: f64,
    /// Factors on the covariance and on the deviation of the time.
    pub(super) spread: f64,
    pub(super) time_spread: f64,
}

impl Errors {
    /// All zero. The default matrix of glam is the identity, which would mean errors of a metre.
    const ZERO: Self = Self {
        regression: DMat3::ZERO,
        primitive: DMat3::ZERO,
        cross: DMat3::ZERO,
        gain: 0.0,
        time: 0.0,
        spread: 0.0,
        time_spread: 0.0,
    };

    /// Between regions: a mixture by their weights.
    fn at(regions: &[Self], gates: &[f64]) -> Self {
        let mut sum = Self::ZERO;
        for (errors, gate) in regions.iter().zip(gates) {
            sum.scaled_add(*gate, errors);
        }
        sum
    }

    fn scaled_add(&mut self, share: f64, other: &Self) {
        self.regression += other.regression * share;
        self.primitive += other.primitive * share;
        self.cross += other.cross * share;
        self.gain += other.gain * share;
        self.time += other.time * share;
        self.spread += other.spread * share;
        self.time_spread += other.time_spread * share;
    }

    /// Mean squared distance between the two sources.
    fn apart(&self) -> f64 {
        trace(&self.regression) + trace(&self.primitive) - 2.0 * trace(&self.cross)
    }

    /// The share of the primitive that makes the squared error least. One number per region: a matrix,
    /// though better in theory, was worse when learnt from fifty reaches.
    fn best_gain(&self) -> f64 {
        let gain = trace(&self.regression) - trace(&self.cross);
        (gain / self.apart().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// The best linear combination and its second moments.
    fn combined(
        &self,
        combination: Combination,
        regression_m: DVec3,
        primitive_m: Option<DVec3>,
    ) -> Combined {
        let (point_m, moments_m2) = match (combination, primitive_m) {
            (Combination::Primitive, Some(primitive_m)) => (primitive_m, self.primitive),
            (Combination::Both, Some(primitive_m)) => {
                let apart = primitive_m.distance_squared(regression_m);
                let usual = self.apart() + trace(&sensor());
                // Sources that are far apart cannot both be right: take the one that usually is.
                let share = if apart <= LOST * LOST * usual {
                    self.gain
                } else {
                    self.gain.round()
                };
                let (a, b) = (1.0 - share, share);
                let cross = self.cross + self.cross.transpose();
                let moments =
                    self.regression * (a * a) + self.primitive * (b * b) + cross * (a * b);
                (regression_m.lerp(primitive_m, b), moments)
            }
            _ => (regression_m, self.regression),
        };
        Combined {
            point_m,
            moments_m2: moments_m2 + sensor(),
        }
    }

    /// Standard deviation of the time left, s.
    pub(super) fn time_sd_s(&self) -> f64 {
        (self.time.sqrt() * self.time_spread).max(CLOCK_S)
    }

    /// By region, with the mean log score of the held-out contacts.
    fn by_region(
        samples: &[TrainingSample],
        rows: &Rows,
        held_out: &[f64],
        combination: Combination,
        axes: Axes,
    ) -> (Vec<Self>, f64) {
        let misses: Vec<Miss> = samples
            .iter()
            .zip(held_out.chunks_exact(rows.outputs))
            .map(|(sample, predicted)| Miss::of(sample, predicted, axes))
            .collect();
        let mut regions: Vec<Self> = (0..rows.regions)
            .map(|region| Self::of_region(&misses, samples, rows, region))
            .collect();
        let scores: Vec<[f64; 2]> = misses
            .iter()
            .enumerate()
            .map(|(row, miss)| {
                let errors = Self::at(&regions, rows.gates(row));
                let off = errors.combined(combination, miss.regression, miss.primitive);
                let distance = off.point_m.dot(off.moments_m2.inverse() * off.point_m);
                [distance, miss.time.abs() / errors.time_sd_s()]
            })
            .collect();
        // There are as many independent errors as reaches. A new error lies below their quantile less
        // often than they do, and a covariance learnt from few is too small for new ones.
        let reaches: f64 = samples.iter().map(|s| s.weight).sum();
        let level = (0.9 * (reaches + 1.0) / reaches).min(1.0);
        let few = (reaches + 1.0) / (reaches - 4.0).max(1.0);
        for (k, region) in regions.iter_mut().enumerate() {
            let most = |which: usize| {
                let values = scores.iter().enumerate();
                weighted_quantile(
                    level,
                    values.map(|(row, s)| (s[which], samples[row].weight * rows.gates(row)[k])),
                )
            };
            (region.spread, region.time_spread) =
                (few * most(0) / CHI_SQUARED_3_90, most(1) / NORMAL_90);
        }
        let score = log_score(&misses, samples, rows, &regions, combination);
        (regions, score)
    }

    fn of_region(misses: &[Miss], samples: &[TrainingSample], rows: &Rows, region: usize) -> Self {
        let weight = |row: usize| samples[row].weight * rows.gates(row)[region];
        let limit = |length: &dyn Fn(&Miss) -> f64| {
            let lengths = misses.iter().enumerate();
            CLIP * weighted_quantile(0.5, lengths.map(|(row, m)| (length(m), weight(row))))
        };
        // Where the primitive has lost its way, the regression counts.
        let primitive = |m: &Miss| m.primitive.unwrap_or(m.regression);
        let limits = [
            limit(&|m| m.regression.length()),
            limit(&|m| primitive(m).length()),
            limit(&|m| m.time.abs()),
        ];
        let (mut sum, mut total) = (Self::ZERO, f64::MIN_POSITIVE);
        for (row, miss) in misses.iter().enumerate() {
            let r = miss.regression.clamp_length_max(limits[0]);
            let p = primitive(miss).clamp_length_max(limits[1]);
            let one = Self {
                regression: square(r),
                primitive: square(p),
                cross: outer(r, p),
                time: miss.time.abs().min(limits[2]).powi(2),
                ..Self::ZERO
            };
            sum.scaled_add(weight(row), &one);
            total += weight(row);
        }
        let mut region = Self::ZERO;
        region.scaled_add(1.0 / total, &sum);
        region.gain = region.best_gain();
        (region.spread, region.time_spread) = (1.0, 1.0);
        region
    }
}

/// Mean log density of the misses; those far out count only up to a limit.
fn log_score(
    misses: &[Miss],
    samples: &[TrainingSample],
    rows: &Rows,
    regions: &[Errors],
    combination: Combination,
) -> f64 {
    let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
    for (row, miss) in misses.iter().enumerate() {
        let errors = Errors::at(regions, rows.gates(row));
        let off = errors.combined(combination, miss.regression, miss.primitive);
        let covariance = off.moments_m2 * errors.spread + sensor();
        let distance = off.point_m.dot(covariance.inverse() * off.point_m);
        let distance = distance.min(FAR_OUT);
        sum -= samples[row].weight * 0.5 * (distance + covariance.determinant().ln());
        total += samples[row].weight;
    }
    sum / total
}

/// How far the sources miss the contact of one sample, in the axes asked for.
struct Miss {
    regression: DVec3,
    primitive: Option<DVec3>,
    time: f64,
}

impl Miss {
    fn of(sample: &TrainingSample, predicted: &[f64], axes: Axes) -> Self {
        let regression_m = sample.now_m + DVec3::from_slice(&predicted[..3]);
        let inverse = axes.of(sample.start_m, regression_m).transpose();
        Self {
            regression: inverse * (regression_m - sample.end_m),
            primitive: sample.primitive_m.map(|p| inverse * (p - sample.end_m)),
            time: predicted[3].max(0.0) - sample.left_s,
        }
    }
}

/// The noise of the sensor as a covariance, m².
fn sensor() -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(SENSOR_M * SENSOR_M))
}

fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// The value below which a share of the weight lies; `values` are pairs of value and weight.
pub(super) fn weighted_quantile(share: f64, values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|v| v.1).sum();
    let mut sum = 0.0;
    let found = values.iter().find(|v| {
        sum += v.1;
        sum >= share * total
    });
    found.or(values.last()).map_or(0.0, |v| v.0)
}
