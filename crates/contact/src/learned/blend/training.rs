//! Learns how to combine the sources from their errors on held-out reaches.

use crate::learned::blend::arrival::{Arrival, Stop};
use crate::learned::blend::calibration::{Calibrated, calibrated};
use crate::learned::blend::combination::{
    Axes, Blend, Combined, Personal, Region, combine, placed,
};
use crate::learned::blend::evidence::{CLIP, Evidence, clip};
use crate::learned::blend::habit::{Habits, PredictedReach, WayLeft, habits};
use crate::learned::blend::knots::{KNOTS, between_knots, nearest_knot, time_key};
use crate::learned::blend::sources::SOURCES;
use crate::learned::blend::turns::Turns;
use crate::learned::quantiles::{SENSOR_M, weighted_quantile};
use glam::DVec3;
use hwall_numeric::parallel;

impl Blend {
    /// From the held-out estimates of all sources.
    ///
    /// Weights and shares are learned from those errors. The spread of a fold is learned from the errors that remain under weights and shares
    /// learned mostly from the other folds; otherwise the stated uncertainty would be too small.
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
        // The axes with the higher likelihood; a tie goes to the axes that turn with the reach.
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

/// Held-out results for training the later stages.
pub(in crate::learned) struct HeldOut {
    /// Held-out estimate of every sample, m.
    pub(in crate::learned) points_m: Vec<DVec3>,
    /// Ratio of the stated covariances to the held-out errors: larger than 1, because errors on new reaches are larger.
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

/// Sets the size of the errors before places, and the typical disagreement.
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

/// Learns the share of the distance to the places to apply; returns the resulting estimates.
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

/// Folds are grouped into this many parts to learn where slow hands stop.
const ARRIVAL_PARTS: usize = 5;

/// Learns where slow hands stop; returns the estimate of every sample, learned without the part that contains its fold.
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

/// Number of independent errors: reaches of one person are correlated [Kish 1965, section 5.4].
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

/// Between-person share of the variance if only one person is known.
const UNKNOWN_SHARE: f64 = 0.03;
/// Largest miss that counts, relative to the typical one.
const MOST_MISS: f64 = 4.0;
const SHARES: [f64; 2] = [0.02, 0.9];

impl Personal {
    /// From the predictions of held-out reaches.
    fn of(evidence: &Evidence, combined: &[Combined], blend: &Blend) -> Self {
        let knots = evidence.of_rows(|row| {
            let left_s = evidence.witnesses[row].left_s;
            nearest_knot(&between_knots(&blend.knots, time_key(left_s)))
        });
        let regions =
            evidence.of_rows(|row| Region::between(&blend.regions, evidence.rows.gates(row)));
        let of_source = |row: usize, k: usize| {
            let miss_m = evidence.witnesses[row].ends_m[k]? - evidence.samples[row].end_m;
            let region = &regions[row];
            Some(miss_m / (region.moments[k][k] * region.size_m2).sqrt())
        };
        let late = |row: usize| {
            let witness = &evidence.witnesses[row];
            let late_s = witness.true_left_s - witness.left_s;
            Some(DVec3::X * (late_s / regions[row].time_sd_s()))
        };
        let at = |knot: usize, miss: &dyn Fn(usize) -> Option<DVec3>| {
            let of_knot: f64 = (0..knots.len())
                .filter(|&row| knots[row] == knot)
                .map(|row| evidence.samples[row].weight)
                .sum();
            // Every reach passes all times left, so the weights at each knot add up to the number of reaches.
            let times = evidence.reaches() / of_knot.max(f64::MIN_POSITIVE);
            lasting(evidence, times, |row| {
                (knots[row] == knot).then(|| miss(row)).flatten()
            })
        };
        Self {
            sources: std::array::from_fn(|knot| {
                std::array::from_fn(|k| at(knot, &|row| of_source(row, k)))
            }),
            time: std::array::from_fn(|knot| at(knot, &late)),
            habits: habits_of(evidence, combined, blend, &regions),
        }
    }
}

fn habits_of(
    evidence: &Evidence,
    combined: &[Combined],
    blend: &Blend,
    regions: &[Region],
) -> [Habits; KNOTS] {
    let mut reaches = vec![PredictedReach::default(); evidence.made];
    for (row, sample) in evidence.samples.iter().enumerate() {
        // Later samples belong to time-scaled copies.
        let Some(reach) = reaches.get_mut(sample.reach) else {
            continue;
        };
        (reach.person, reach.contact_m) = (evidence.people[row], sample.end_m);
        let left = WayLeft {
            now_m: sample.now_m,
            end_m: combined[row].point_m,
            variance_m2: regions[row].axis_variance_m2(),
        };
        let hats = between_knots(&blend.knots, time_key(evidence.witnesses[row].left_s));
        for (lefts, hat) in reach.left.iter_mut().zip(hats) {
            if hat > 0.0 {
                lefts.push((left, hat));
            }
        }
    }
    habits(evidence.person_count(), &reaches)
}

/// The between-person share of errors in units of their typical size: variance of the means of people, minus the sampling variance of those means.
/// `times` scales the weights of samples to reach counts.
fn lasting(evidence: &Evidence, times: f64, miss: impl Fn(usize) -> Option<DVec3>) -> f64 {
    // Sums of the errors, of their squares and of the weights.
    let mut sums = vec![(DVec3::ZERO, 0.0, 0.0); evidence.person_count()];
    for (row, sample) in evidence.samples.iter().enumerate() {
        let Some(miss) = miss(row).filter(|m| m.is_finite()) else {
            continue;
        };
        let (miss, weight) = (miss.clamp_length_max(MOST_MISS), times * sample.weight);
        let (sum, square, n) = &mut sums[evidence.people[row]];
        *sum += miss * weight;
        *square += miss.length_squared() * weight;
        *n += weight;
    }
    let (mut between, mut within, mut n) = (0.0, 0.0, 0.0);
    for (sum, square, reaches) in sums.into_iter().filter(|s| s.2 > 1.5) {
        let mean = (sum / reaches).length_squared();
        let own = (square / reaches - mean).max(0.0) * reaches / (reaches - 1.0);
        between += (mean - own / reaches).max(0.0);
        within += own;
        n += 1.0;
    }
    if n < 2.0 {
        return UNKNOWN_SHARE;
    }
    (between / (between + within).max(1e-9)).clamp(SHARES[0], SHARES[1])
}
