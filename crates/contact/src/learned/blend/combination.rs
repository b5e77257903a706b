//! How the sources of an estimate are combined, and how sure the combination is, learnt from errors on reaches that
//! were held out.

use crate::learned::blend::arrival::Arrival;
use crate::learned::blend::habit::Habits;
use crate::learned::blend::knots::KNOTS;
use crate::learned::blend::places::Places;
use crate::learned::blend::sources::{Ends, Pairs, SOURCES, Source, weights};
use crate::learned::quantiles::{SENSOR_M, sensor};
use crate::learned::reaches::reach_track::way_axes;
use glam::{DMat3, DVec3};

/// Lowest standard deviation of a time, s.
const CLOCK_S: f64 = 2e-3;
/// A source that is further from the others than this many times the usual has lost its way.
const LOST: f64 = 3.0;
/// Largest ratio of a disagreement to the usual one that counts.
const MOST_DISAGREEMENT: f64 = 30.0;
/// In which axes errors are alike from reach to reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub(in crate::learned) enum Axes {
    /// Along the way from start to end and across it: people miss along their way.
    Way,
    /// Those of the samples: along the normal of a wall, contacts that all lie on it are certain.
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

/// What is known of the errors in one region of progress.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Region {
    /// Mean square of the error of the combination, m²; what follows is in units of it.
    pub(in crate::learned) size_m2: f64,
    /// `E[eᵢ·eⱼ]` of the sources.
    pub(in crate::learned) moments: Pairs,
    /// `E[e eᵀ]` of the combination.
    pub(in crate::learned) shape: DMat3,
    /// Mean square of the error before places were considered.
    pub(in crate::learned) unplaced: f64,
    /// Usual disagreement of the sources.
    pub(in crate::learned) apart: f64,
    /// Mean square of the way to the places.
    pub(in crate::learned) placed: f64,
    /// Share of the way from the combination to the places that is gone.
    pub(in crate::learned) share: f64,
    /// Factor on the covariance that makes 90 % regions hold 90 %.
    pub(in crate::learned) spread: f64,
    /// Mean square of the error of the time left, s², with a factor for its 90 % intervals.
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

    /// Between regions: what is relative is mixed by their weights, and sizes by their logarithms, so that a region of
    /// large errors does not make its neighbours unsure.
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

    /// The mean of logarithms of all regions, for those who ask often.
    pub(super) fn logarithm_between(logarithms: &[f64], gates: &[f64]) -> f64 {
        let counted = logarithms.iter().zip(gates).filter(|(_, g)| **g > 0.0);
        counted.map(|(logarithm, gate)| gate * logarithm).sum()
    }

    /// Mean square of the error before places were considered, in each axis, m².
    pub(in crate::learned) fn axis_variance_m2(&self) -> f64 {
        self.unplaced * self.size_m2 / 3.0
    }

    /// Standard deviation of the time left, s.
    pub(in crate::learned) fn time_sd_s(&self) -> f64 {
        self.time_s2.sqrt().max(CLOCK_S)
    }

    /// The same between regions, of the logarithms of their `time_s2`; see [`between`](Self::between).
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

/// The combination of sources, whose moments are in any unit; `ratios` are factors on the size of their errors. A
/// source far from all others is left out. `None` without a source.
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
        // Against the others alone: a source must not pull what it is compared with.
        let others = 1.0 - combined.weights[k];
        if others < 1e-3 || k == Source::Start as usize {
            continue;
        }
        let far = end_m.distance(combined.point_m) / others;
        let usual = (moments[k][k] + 1.0) * region.size_m2 + 3.0 * SENSOR_M * SENSOR_M;
        if far * far > LOST * LOST * usual {
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
    // Relative to one of them: far from the origin nothing is lost to rounding.
    let point_m = first_m + each().map(|(e, w)| (e - first_m) * w).sum::<DVec3>();
    let apart_m2 = each().map(|(e, w)| e.distance_squared(point_m) * w).sum();
    Some(Combined {
        point_m,
        apart_m2,
        weights,
    })
}

/// What is a person's own, at the times left of the knots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::learned) struct Personal {
    /// Share of the mean squared error of each source.
    pub(in crate::learned) sources: [[f64; SOURCES]; KNOTS],
    /// Share of the mean squared error of the time left.
    pub(in crate::learned) time: [f64; KNOTS],
    /// How people end elsewhere than foreseen.
    pub(in crate::learned) habits: [Habits; KNOTS],
}

impl Personal {
    /// The same for all sources and times left, before anything is learnt.
    pub(in crate::learned) const fn even(share: f64) -> Self {
        Self {
            sources: [[share; SOURCES]; KNOTS],
            time: [share; KNOTS],
            habits: [Habits::NONE; KNOTS],
        }
    }

    /// Share of the mean squared error of each source at one time left that is corrected in the source itself. Where the offset
    /// of the habit is learnt, only what moves is: else the same would be learnt twice, by the sources less exactly.
    pub(in crate::learned) fn lasting(&self, knot: usize) -> [f64; SOURCES] {
        match self.habits[knot].offset > 0.0 {
            true => [0.0; SOURCES],
            false => self.sources[knot],
        }
    }
}

/// All that is known of the errors of a model.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::learned) struct Blend {
    pub(in crate::learned) axes: Axes,
    pub(in crate::learned) arrival: Arrival,
    pub(in crate::learned) regions: Vec<Region>,
    /// The covariance goes with this power of the disagreement of the sources.
    pub(in crate::learned) by_disagreement: f64,
    /// Values of the time left, as [`time_key`](super::knots::time_key), and the factors on the covariance there.
    pub(in crate::learned) knots: [f64; KNOTS],
    pub(in crate::learned) factors: [f64; KNOTS],
    /// Mean squared distance from the truth at those times left, in standard deviations and per axis.
    pub(in crate::learned) usual_distances: [f64; KNOTS],
    /// What of the errors is one person's own.
    pub(in crate::learned) personal: Personal,
}

impl Blend {
    /// The factor on the covariance for a disagreement of the sources.
    pub(in crate::learned) fn doubt(&self, region: &Region, apart_m2: f64) -> f64 {
        let usual = region.apart * region.size_m2 + SENSOR_M * SENSOR_M;
        disagreement(apart_m2 / usual).powf(self.by_disagreement)
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

    /// The factor on the covariance at a time left.
    pub(in crate::learned) fn at_time(&self, hats: &[f64; KNOTS]) -> f64 {
        let pairs = hats.iter().zip(&self.factors);
        pairs.map(|(h, f)| h * f.ln()).sum::<f64>().exp()
    }
}

/// A ratio to the usual disagreement, kept within bounds.
pub(in crate::learned) fn disagreement(ratio: f64) -> f64 {
    ratio.clamp(0.0, MOST_DISAGREEMENT) + 0.2
}

/// What the estimate says once places are considered.
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
