//! The combination of the sources of an estimate and its uncertainty, learned from errors on held-out reaches.

use crate::learned::blend::arrival::Arrival;
use crate::learned::blend::habit::Habits;
use crate::learned::blend::knots::KNOTS;
use crate::learned::blend::places::Places;
use crate::learned::blend::sources::{Ends, Pairs, SOURCES, Source, weights};
use crate::learned::quantiles::{SENSOR_M, sensor};
use crate::learned::reaches::reach_track::way_axes;
use glam::{DMat3, DVec3};

const CLOCK_S: f64 = 2e-3;
/// A source further from the others than this many times the expected distance is discarded.
const LOST: f64 = 3.0;
/// Largest disagreement that counts, relative to the typical one.
const MOST_DISAGREEMENT: f64 = 30.0;
/// Axes in which error statistics are pooled over reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub(in crate::learned) enum Axes {
    /// Along the line from start to end and across it: people miss along their path.
    Way,
    /// Axes of the samples: contacts that all lie on one wall are certain along its normal.
    World,
}

impl Axes {
    pub(in crate::learned) fn of(self, start_m: DVec3, end_m: DVec3) -> DMat3 {
        match self {
            Self::Way => way_axes(start_m, end_m),
            Self::World => DMat3::IDENTITY,
        }
    }
}

/// Error statistics in one region of progress.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Region {
    /// Mean square of the error of the combination, m²; unit of the fields below.
    pub(in crate::learned) size_m2: f64,
    /// `E[eᵢ·eⱼ]` of the sources.
    pub(in crate::learned) moments: Pairs,
    /// `E[e eᵀ]` of the combination.
    pub(in crate::learned) shape: DMat3,
    /// Mean square of the error before places are considered.
    pub(in crate::learned) unplaced: f64,
    /// Typical disagreement of the sources.
    pub(in crate::learned) apart: f64,
    /// Mean square of the displacement to the places.
    pub(in crate::learned) placed: f64,
    /// Share of the displacement from the combination to the places that is applied.
    pub(in crate::learned) share: f64,
    /// Factor on the covariance that makes 90 % regions contain 90 % of the ends.
    pub(in crate::learned) spread: f64,
    /// Mean square of the error of the time left, s², including the factor for its 90 % intervals.
    pub(in crate::learned) time_s2: f64,
}

impl Region {
    pub(in crate::learned) const ZERO: Self = Self {
        size_m2: 0.0,
        moments: [[0.0; SOURCES]; SOURCES],
        shape: DMat3::ZERO,
        unplaced: 0.0,
        apart: 0.0,
        placed: 0.0,
        share: 0.0,
        spread: 0.0,
        time_s2: 0.0,
    };

    /// Interpolates between regions: relative quantities linearly, sizes by their logarithms, so that a region of large errors does not inflate its
    /// neighbours.
    pub(in crate::learned) fn between(regions: &[Self], gates: &[f64]) -> Self {
        let mut mixed = Self::ZERO;
        for (region, &gate) in regions.iter().zip(gates) {
            if gate <= 0.0 {
                continue;
            }
            for (own, other) in mixed.moments.iter_mut().zip(&region.moments) {
                for (own, other) in own.iter_mut().zip(other) {
                    *own += gate * other;
                }
            }
            mixed.shape += region.shape * gate;
            mixed.unplaced += gate * region.unplaced;
            mixed.apart += gate * region.apart;
            mixed.placed += gate * region.placed;
            mixed.share += gate * region.share;
            mixed.size_m2 += gate * region.size_m2.ln();
            mixed.spread += gate * region.spread.ln();
            mixed.time_s2 += gate * region.time_s2.ln();
        }
        mixed.size_m2 = mixed.size_m2.exp();
        mixed.spread = mixed.spread.exp();
        mixed.time_s2 = mixed.time_s2.exp();
        mixed
    }

    /// The spread alone; see [`between`](Self::between).
    pub(in crate::learned) fn spread_between(regions: &[Self], gates: &[f64]) -> f64 {
        let counted = regions.iter().zip(gates).filter(|(_, gate)| **gate > 0.0);
        counted
            .map(|(r, gate)| gate * r.spread.ln())
            .sum::<f64>()
            .exp()
    }

    /// Interpolated logarithm from precomputed logarithms of all regions, for frequent use.
    pub(super) fn logarithm_between(logarithms: &[f64], gates: &[f64]) -> f64 {
        let counted = logarithms.iter().zip(gates).filter(|(_, g)| **g > 0.0);
        counted.map(|(logarithm, gate)| gate * logarithm).sum()
    }

    /// Mean square per axis of the error before places are considered, m².
    pub(in crate::learned) fn axis_variance_m2(&self) -> f64 {
        self.unplaced * self.size_m2 / 3.0
    }

    /// Standard deviation of the time left, s.
    pub(in crate::learned) fn time_sd_s(&self) -> f64 {
        self.time_s2.sqrt().max(CLOCK_S)
    }

    /// Standard deviation of the time left, s, interpolated from the logarithms of the regions' `time_s2`; see [`between`](Self::between).
    pub(super) fn time_sd_between_s(logarithms: &[f64], gates: &[f64]) -> f64 {
        let logarithm = Self::logarithm_between(logarithms, gates);
        logarithm.exp().sqrt().max(CLOCK_S)
    }
}

/// The combination of the sources before places are considered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::learned) struct Combined {
    pub(in crate::learned) point_m: DVec3,
    /// Mean squared distance of the sources from it, by their weights, m².
    pub(in crate::learned) apart_m2: f64,
    pub(in crate::learned) weights: [f64; SOURCES],
}

/// The combination of sources. The unit of the moments cancels; `ratios` scale the error variance of each source. A source far from all others is
/// left out. `None` without a source.
pub(in crate::learned) fn combine(
    region: &Region,
    ends: &Ends,
    ratios: &[f64; SOURCES],
) -> Option<Combined> {
    let mut moments = region.moments;
    for (i, row) in moments.iter_mut().enumerate() {
        for (j, m) in row.iter_mut().enumerate() {
            *m *= (ratios[i] * ratios[j]).sqrt();
        }
    }
    let mut there = ends.map(|e| e.is_some());
    let mut combined = weighted(&moments, ends, there)?;
    let mut left_out = false;
    for k in 0..SOURCES {
        let Some(end_m) = ends[k].filter(|_| combined.weights[k] > 0.0) else {
            continue;
        };
        // Compare with the others alone: a source must not shift its own reference.
        let others = 1.0 - combined.weights[k];
        if others < 1e-3 || k == Source::Start as usize {
            continue;
        }
        let far = end_m.distance(combined.point_m) / others;
        let typical = (moments[k][k] + 1.0) * region.size_m2 + 3.0 * SENSOR_M * SENSOR_M;
        if far * far > LOST * LOST * typical {
            there[k] = false;
            left_out = true;
        }
    }
    if left_out && there.iter().any(|t| *t) {
        combined = weighted(&moments, ends, there)?;
    }
    Some(combined)
}

fn weighted(moments: &Pairs, ends: &Ends, there: [bool; SOURCES]) -> Option<Combined> {
    let first_m = (0..SOURCES).find_map(|k| ends[k].filter(|_| there[k]))?;
    let weights = weights(moments, there);
    let each = || {
        let pairs = ends.iter().zip(&weights);
        pairs.filter_map(|(e, w)| Some((e.as_ref().copied()?, *w)))
    };
    // Relative to one end, which avoids rounding errors far from the origin.
    let point_m = first_m + each().map(|(e, w)| (e - first_m) * w).sum::<DVec3>();
    let apart_m2 = each().map(|(e, w)| e.distance_squared(point_m) * w).sum();
    Some(Combined {
        point_m,
        apart_m2,
        weights,
    })
}

/// Between-person share of the errors, at the knots of the time left.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Personal {
    /// Share of the mean squared error of each source.
    pub(in crate::learned) sources: [[f64; SOURCES]; KNOTS],
    /// Share of the mean squared error of the time left.
    pub(in crate::learned) time: [f64; KNOTS],
    /// How the ends of a person deviate from the predictions.
    pub(in crate::learned) habits: [Habits; KNOTS],
}

impl Personal {
    /// The same share for all sources and times left, before training.
    pub(in crate::learned) const fn even(share: f64) -> Self {
        Self {
            sources: [[share; SOURCES]; KNOTS],
            time: [share; KNOTS],
            habits: [Habits::NONE; KNOTS],
        }
    }

    /// Share of the mean squared error of each source at one time left that the source itself corrects. 0 where the habit learns an offset:
    /// otherwise the sources would learn the same offset again, less exactly.
    pub(in crate::learned) fn lasting(&self, knot: usize) -> [f64; SOURCES] {
        match self.habits[knot].offset > 0.0 {
            true => [0.0; SOURCES],
            false => self.sources[knot],
        }
    }
}

/// Error statistics of a model.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Blend {
    pub(in crate::learned) axes: Axes,
    pub(in crate::learned) arrival: Arrival,
    pub(in crate::learned) regions: Vec<Region>,
    /// The covariance grows with this power of the disagreement of the sources.
    pub(in crate::learned) by_disagreement: f64,
    /// Knots of the time left, as [`time_key`](super::knots::time_key), and the factors on the covariance there.
    pub(in crate::learned) knots: [f64; KNOTS],
    pub(in crate::learned) factors: [f64; KNOTS],
    /// Mean squared error at those times left, in standard deviations and per axis.
    pub(in crate::learned) typical_distances: [f64; KNOTS],
    /// Between-person share of the errors.
    pub(in crate::learned) personal: Personal,
}

impl Blend {
    /// Factor on the covariance for a disagreement of the sources.
    pub(in crate::learned) fn doubt(&self, region: &Region, apart_m2: f64) -> f64 {
        let typical = region.apart * region.size_m2 + SENSOR_M * SENSOR_M;
        disagreement(apart_m2 / typical).powf(self.by_disagreement)
    }

    /// The covariance of an estimate, m².
    pub(in crate::learned) fn covariance_m2(
        &self,
        region: &Region,
        factor: f64,
        start_m: DVec3,
        end_m: DVec3,
    ) -> DMat3 {
        let axes = self.axes.of(start_m, end_m);
        let moments = region.shape * (region.size_m2 * region.spread * factor) + sensor();
        let covariance = axes * moments * axes.transpose();
        (covariance + covariance.transpose()) * 0.5
    }

    /// The factor on the covariance at the time left that `hats` describes.
    pub(in crate::learned) fn at_time(&self, hats: &[f64; KNOTS]) -> f64 {
        let pairs = hats.iter().zip(&self.factors);
        pairs.map(|(h, f)| h * f.ln()).sum::<f64>().exp()
    }
}

/// Disagreement relative to the typical one, bounded.
pub(in crate::learned) fn disagreement(ratio: f64) -> f64 {
    ratio.clamp(0.0, MOST_DISAGREEMENT) + 0.2
}

/// The estimate after places are considered, and the places near it, m.
pub(in crate::learned) fn placed(
    places: Option<&Places>,
    region: &Region,
    share: f64,
    point_m: DVec3,
    own_m: &[DVec3],
    without: Option<usize>,
) -> (DVec3, Option<DVec3>) {
    let square_m2 = region.axis_variance_m2();
    let nearest = places.and_then(|p| p.nearest(point_m, square_m2, own_m, without));
    let drawn_m = nearest.map_or(point_m, |p| point_m.lerp(p, share));
    (drawn_m, nearest)
}
