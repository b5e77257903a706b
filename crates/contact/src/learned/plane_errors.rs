//! Errors of an estimate by the plane that is touched.
//!
//! An estimate that has seen little of a reach lies near the middle of all places that people touched. For a reach to one plane
//! that middle is off to one side, always the same one, and further than the errors of all reaches together say.

use super::samples::TrainingSample;
use crate::outer_product::square;
use glam::{DMat3, DVec3};

/// Contacts are in one plane if their normals agree to this cosine (10 degrees) ...
const SAME_NORMAL_COS: f64 = 0.985;
/// ... and their offsets along it to this length, m.
const SAME_OFFSET_M: f64 = 0.05;
/// Planes that were touched less often than this in a region of progress say nothing about it.
const FEWEST: f64 = 4.0;
/// Covariances are pulled towards that of all planes as if by this many reaches.
const PULL: f64 = 6.0;

/// Shares of the way that are gone by then; between them errors are interpolated.
const NODES: [f64; 7] = [0.0, 0.05, 0.12, 0.25, 0.45, 0.7, 1.0];
/// The way left is never less than this, m: tracked points and labels have errors too.
const LEAST_LEFT_M: f64 = 0.02;

/// How far a reach has come, by an estimate of its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    gone: f64,
    left_m: f64,
}

impl Way {
    pub(super) fn new(start_m: DVec3, now_m: DVec3, end_m: DVec3) -> Self {
        let gone_m = now_m.distance(start_m);
        let left_m = now_m.distance(end_m).max(LEAST_LEFT_M);
        Self {
            gone: gone_m / (gone_m + left_m),
            left_m,
        }
    }

    fn weights(&self) -> [f64; NODES.len()] {
        let last = NODES.len() - 1;
        let above = NODES.partition_point(|n| *n <= self.gone).clamp(1, last);
        let (low, high) = (NODES[above - 1], NODES[above]);
        let x = ((self.gone - low) / (high - low)).clamp(0.0, 1.0);
        let mut weights = [0.0; NODES.len()];
        weights[above - 1] = 1.0 - x;
        weights[above] = x;
        weights
    }
}

/// Errors of reaches to one plane, in the frame of the samples, as shares of the way left, by the share that is gone.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlaneErrors {
    pub(super) normal: DVec3,
    /// Distance from the origin along the normal, m.
    pub(super) offset_m: f64,
    pub(super) regions: Vec<Off>,
}

/// Estimate minus contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Off {
    pub(super) mean_m: DVec3,
    pub(super) covariance_m2: DMat3,
    /// How far this can be believed: 0 where too few reaches were seen.
    pub(super) known: f64,
}

impl Off {
    const ZERO: Self = Self {
        mean_m: DVec3::ZERO,
        covariance_m2: DMat3::ZERO,
        known: 0.0,
    };
}

/// One sample's share in the errors of its plane.
struct Part {
    reach: usize,
    weight: f64,
    off: DVec3,
}

impl PlaneErrors {
    /// By plane; `off_m` are the held-out errors of the samples, `gates` the regions' weights of each.
    pub(super) fn of(samples: &[TrainingSample], off_m: &[DVec3]) -> Vec<Self> {
        let mut planes: Vec<Self> = Vec::new();
        let mut of_sample = Vec::with_capacity(samples.len());
        for sample in samples {
            let Some(normal) = sample.normal else {
                of_sample.push(usize::MAX);
                continue;
            };
            let offset_m = normal.dot(sample.end_m);
            let known = planes.iter().position(|p| p.is_at(sample.end_m, normal));
            of_sample.push(known.unwrap_or_else(|| {
                planes.push(Self {
                    normal,
                    offset_m,
                    regions: Vec::new(),
                });
                planes.len() - 1
            }));
        }
        let mut parts: Vec<Vec<Vec<Part>>> = planes
            .iter()
            .map(|_| (0..NODES.len()).map(|_| Vec::new()).collect())
            .collect();
        for ((sample, &plane), &off_m) in samples.iter().zip(&of_sample).zip(off_m) {
            let Some(plane) = parts.get_mut(plane) else {
                continue;
            };
            let way = Way::new(sample.start_m, sample.now_m, sample.end_m + off_m);
            let weights = way.weights();
            for (region, gate) in plane.iter_mut().zip(&weights) {
                if *gate > 0.0 {
                    region.push(Part {
                        reach: sample.reach,
                        weight: sample.weight * gate,
                        off: off_m / way.left_m,
                    });
                }
            }
        }
        for region in 0..NODES.len() {
            let each: Vec<(Off, f64)> = parts.iter().map(|p| moments(&p[region])).collect();
            let total: f64 = each.iter().map(|e| e.1).sum();
            let mut pooled = DMat3::ZERO;
            for (off, reaches) in &each {
                pooled += off.covariance_m2 * (reaches / total.max(f64::MIN_POSITIVE));
            }
            for (plane, (off, reaches)) in planes.iter_mut().zip(each) {
                plane.regions.push(shrunk(&off, reaches, &pooled));
            }
        }
        planes
    }

    /// Is a place in this plane?
    pub(super) fn is_at(&self, point_m: DVec3, normal: DVec3) -> bool {
        let cos = self.normal.dot(normal);
        let off_m = self.normal.dot(point_m) - self.offset_m;
        cos >= SAME_NORMAL_COS && off_m.abs() <= SAME_OFFSET_M
    }

    /// The errors at a progress; `None` where too little is known.
    pub(super) fn at(&self, way: &Way) -> Option<Off> {
        let mut sum = Off::ZERO;
        for (off, gate) in self.regions.iter().zip(way.weights()) {
            let weight = gate * off.known;
            sum.mean_m += off.mean_m * weight;
            sum.covariance_m2 += off.covariance_m2 * weight;
            sum.known += weight;
        }
        let known = sum.known;
        (known > 0.5).then(|| Off {
            mean_m: sum.mean_m * (way.left_m / known),
            covariance_m2: sum.covariance_m2 * (way.left_m * way.left_m / known),
            known,
        })
    }
}

/// Mean, covariance about it, and how many reaches they stand for.
fn moments(parts: &[Part]) -> (Off, f64) {
    let total: f64 = parts.iter().map(|p| p.weight).sum();
    if total <= 0.0 {
        return (Off::ZERO, 0.0);
    }
    // Samples of one reach have one error.
    let mut by_reach: Vec<(usize, f64)> = Vec::new();
    for part in parts {
        match by_reach.last_mut() {
            Some((reach, sum)) if *reach == part.reach => *sum += part.weight,
            _ => by_reach.push((part.reach, part.weight)),
        }
    }
    let squares: f64 = by_reach.iter().map(|r| r.1 * r.1).sum();
    let reaches = total * total / squares;
    let mean_m = parts
        .iter()
        .map(|p| p.off * (p.weight / total))
        .sum::<DVec3>();
    let mut covariance_m2 = DMat3::ZERO;
    for part in parts {
        covariance_m2 += square(part.off - mean_m) * (part.weight / total);
    }
    // Unbiased.
    covariance_m2 *= reaches / (reaches - 1.0).max(1.0);
    let off = Off {
        mean_m,
        covariance_m2,
        known: 1.0,
    };
    (off, reaches)
}

/// Pulled towards what all planes have in common, the more the fewer reaches there are.
fn shrunk(off: &Off, reaches: f64, pooled: &DMat3) -> Off {
    if reaches < FEWEST {
        return Off::ZERO;
    }
    let covariance_m2 = (off.covariance_m2 * reaches + *pooled * PULL) * (1.0 / (reaches + PULL));
    // James and Stein: a mean that may be chance is none.
    let chance = trace(&covariance_m2) / reaches;
    let kept = (1.0 - chance / off.mean_m.length_squared().max(f64::MIN_POSITIVE)).max(0.0);
    let mean_m = off.mean_m * kept;
    Off {
        mean_m,
        covariance_m2: covariance_m2 * (1.0 + 1.0 / reaches)
            + square(off.mean_m - mean_m) * (1.0 - kept),
        known: 1.0,
    }
}

fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}
