//! Learns how to combine sources from their errors on held-out reaches.

use crate::learned::blend::arrival::{Arrival, Stop};
use crate::learned::blend::calibration::{Calibrated, calibrated};
use crate::learned::blend::combination::{Axes, Blend, Combined, Region, combine, placed};
use crate::learned::blend::evidence::{CLIP, Evidence, clip};
use crate::learned::blend::personal::{Personal, lasting};
use crate::learned::blend::quantiles::{SENSOR_M, weighted_quantile};
use crate::learned::blend::sources::SOURCES;
use crate::learned::blend::turns::Turns;
use glam::DVec3;
use hwall_numeric::parallel;

impl Blend {
    /// From what the sources say of every sample when its fold is held out.
    ///
    /// Weights and shares are learnt from those errors; the spread is learnt from the errors of a fold that remain under
    /// weights and shares mostly of the others. Else estimates would look better than the next one will be.
    ///
    pub(in crate::learned) fn of(evidence: &Evidence) -> (Self, HeldOut) {
        let mut turns = Turns::new(evidence.rows.regions, evidence.folds());
        moments(evidence, &mut turns);
        let combined = combinations(evidence, &turns);
        disagreements(evidence, &combined, &mut turns);
        let points_m = shares(evidence, &combined, &mut turns);
        let (arrival, points_m) = arrivals(evidence, &points_m);
        let independent = independent(evidence, &points_m, &turns.all);
        let in_axes = |axes: Axes| {
            let turns = turns.clone();
            calibrated(evidence, &combined, &points_m, turns, axes, independent)
        };
        const BOTH: [Axes; 2] = [Axes::Way, Axes::World];
        let both = parallel::map(BOTH.len(), |k| in_axes(BOTH[k])).into_iter();
        // The more likely of the two; a tie goes to the axes that turn with the reach.
        let better = both.reduce(|way, world| if world.score > way.score { world } else { way });
        let Calibrated {
            mut blend,
            optimism,
            ..
        } = better.unwrap_or_else(|| in_axes(Axes::Way));
        blend.arrival = arrival;
        blend.personal = Personal::of(evidence, &combined, &blend);
        (blend, HeldOut { points_m, optimism })
    }
}

/// What is left of the training for those who learn from held-out errors.
pub(in crate::learned) struct HeldOut {
    /// Where every sample points by what was learnt without its fold, m.
    pub(in crate::learned) points_m: Vec<DVec3>,
    /// How many times as large covariances are as held-out errors ask for, since those to come are larger.
    pub(in crate::learned) optimism: f64,
}

/// Second moments of the errors of the sources in a region, in units of the smallest.
fn moments(evidence: &Evidence, turns: &mut Turns) {
    const PAIRS: usize = SOURCES * SOURCES;
    let sums_of = |region: usize| {
        let near = evidence.rows_of(region);
        let miss = |row: usize, k: usize| {
            let end_m = evidence.witnesses[row].ends_m[k]?;
            Some(end_m - evidence.samples[row].end_m)
        };
        let limits: [f64; SOURCES] = std::array::from_fn(|k| {
            let lengths = near
                .iter()
                .filter_map(|&(row, weight)| Some((miss(row, k)?.length(), weight)));
            CLIP * weighted_quantile(0.5, lengths)
        });
        // Sums of the products, then of their weights.
        let weights: [usize; 2 * PAIRS] = std::array::from_fn(|k| PAIRS + k % PAIRS);
        evidence.sums(region, weights, |row, weight| {
            let misses: [Option<DVec3>; SOURCES] = std::array::from_fn(|k| {
                miss(row, k).map(|m| m.clamp_length_max(limits[k].max(f64::MIN_POSITIVE)))
            });
            let mut out = [0.0; 2 * PAIRS];
            for i in 0..SOURCES {
                for j in 0..SOURCES {
                    if let (Some(a), Some(b)) = (misses[i], misses[j]) {
                        out[i * SOURCES + j] = weight * a.dot(b);
                        out[PAIRS + i * SOURCES + j] = weight;
                    }
                }
            }
            out
        })
    };
    for (region, sums) in evidence.of_regions(sums_of).iter().enumerate() {
        turns.learn(region, sums, |out, sums| {
            let mut least = f64::INFINITY;
            for i in 0..SOURCES {
                for j in 0..SOURCES {
                    let noise = if i == j {
                        3.0 * SENSOR_M * SENSOR_M
                    } else {
                        0.0
                    };
                    let total = sums[PAIRS + i * SOURCES + j].max(f64::MIN_POSITIVE);
                    out.moments[i][j] = sums[i * SOURCES + j] / total + noise;
                }
                if sums[PAIRS + i * (SOURCES + 1)] > 0.0 {
                    least = least.min(out.moments[i][i]);
                }
            }
            let size = if least.is_finite() { least } else { 1.0 };
            out.moments.iter_mut().flatten().for_each(|m| *m /= size);
            out.size_m2 = size;
            (out.spread, out.unplaced, out.time_s2) = (1.0, 1.0, 1.0);
        });
    }
}

fn combinations(evidence: &Evidence, turns: &Turns) -> Vec<Combined> {
    evidence.of_rows(|row| {
        let region = evidence.held_out(turns, row);
        let ends_m = &evidence.witnesses[row].ends_m;
        combine(&region, ends_m, &[1.0; SOURCES]).unwrap_or(Combined {
            point_m: evidence.samples[row].now_m,
            apart_m2: 0.0,
            weights: [0.0; SOURCES],
        })
    })
}

/// Sets the size of the errors before places, and the usual disagreement.
fn disagreements(evidence: &Evidence, combined: &[Combined], turns: &mut Turns) {
    let miss = |row: usize| combined[row].point_m.distance(evidence.samples[row].end_m);
    let sums_of = |region: usize| {
        let limit = clip(evidence.rows_of(region), &miss);
        evidence.sums(region, [2; 3], |row, weight| {
            let square = miss(row).min(limit).powi(2);
            let apart = combined[row].apart_m2.min(limit * limit);
            [weight * square, weight * apart, weight]
        })
    };
    for (region, sums) in evidence.of_regions(sums_of).iter().enumerate() {
        turns.learn(region, sums, |out, [square, apart, total]| {
            let total = total.max(f64::MIN_POSITIVE);
            out.unplaced = (square / total + 3.0 * SENSOR_M * SENSOR_M) / out.size_m2;
            out.apart = apart / total / out.size_m2;
        });
    }
}

/// Learns how far towards the places to go; returns where every sample then points.
fn shares(evidence: &Evidence, combined: &[Combined], turns: &mut Turns) -> Vec<DVec3> {
    let so_far = &*turns;
    let nearest: Vec<Option<DVec3>> = evidence.of_rows(|row| {
        let region = evidence.held_out(so_far, row);
        let (point_m, own) = (combined[row].point_m, Some(evidence.samples[row].fold));
        placed(evidence.places, &region, 1.0, point_m, &[], own).1
    });
    let way = |row: usize| nearest[row].map_or(DVec3::ZERO, |p| p - combined[row].point_m);
    let miss = |row: usize| combined[row].point_m - evidence.samples[row].end_m;
    let sums_of = |region: usize| {
        let near = evidence.rows_of(region);
        let limit = clip(near, &|row| miss(row).length());
        evidence.sums(region, [2; 3], |row, weight| {
            let (miss, way) = (miss(row).clamp_length_max(limit.max(1e-9)), way(row));
            [
                -weight * miss.dot(way),
                weight * way.length_squared(),
                weight,
            ]
        })
    };
    for (region, sums) in evidence.of_regions(sums_of).iter().enumerate() {
        turns.learn(region, sums, |out, [towards, square, total]| {
            let total = total.max(f64::MIN_POSITIVE);
            out.share = (towards / square.max(1e-12 * total)).clamp(0.0, 1.0);
            out.placed = square / total / out.size_m2;
        });
    }
    let pairs = nearest.iter().zip(combined).enumerate();
    pairs
        .map(|(row, (nearest, combined))| {
            let share = evidence.held_out(turns, row).share;
            nearest.map_or(combined.point_m, |p| combined.point_m.lerp(p, share))
        })
        .collect()
}

/// Folds are joined to so many parts for where slow hands stop.
const ARRIVAL_PARTS: usize = 5;

/// Learns where slow hands stop; returns where every sample then points by what was learnt without the part that its fold
/// is in.
fn arrivals(evidence: &Evidence, points_m: &[DVec3]) -> (Arrival, Vec<DVec3>) {
    let stops = evidence.each().map(|(row, sample, _)| Stop {
        progress: sample.progress,
        weight: sample.weight,
        now_m: sample.now_m,
        said_m: points_m[row],
        end_m: sample.end_m,
    });
    let stops: Vec<Stop> = stops.collect();
    let part = |row: usize| evidence.samples[row].fold % ARRIVAL_PARTS;
    let parts = evidence.folds().min(ARRIVAL_PARTS);
    let without: Vec<Arrival> = parallel::map(parts, |held_out| {
        let others = stops.iter().enumerate();
        let others = others.filter(|(row, _)| parts == 1 || part(*row) != held_out);
        Arrival::of(others.map(|(_, stop)| stop))
    });
    let points = stops.iter().enumerate();
    let points = points.map(|(row, s)| without[part(row)].stop_m(&s.progress, s.now_m, s.said_m));
    let points_m = points.collect();
    (Arrival::of(stops.iter()), points_m)
}

/// How many independent errors the estimates have: reaches of one person are alike [Kish 1965, section 5.4].
fn independent(evidence: &Evidence, points_m: &[DVec3], regions: &[Region]) -> f64 {
    let alike = lasting(evidence, 1.0, |row| {
        let region = Region::between(regions, evidence.rows.gates(row));
        let miss_m = points_m[row] - evidence.samples[row].end_m;
        Some(miss_m / (region.unplaced * region.size_m2).sqrt())
    });
    let reaches = evidence.reaches();
    let each = reaches / evidence.person_count() as f64;
    reaches / (1.0 + (each - 1.0).max(0.0) * alike)
}
