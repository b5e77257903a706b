//! Learns how to combine sources from their errors on held-out reaches.

use crate::learned::blend::arrival::{Arrival, Stop};
use crate::learned::blend::combination::{
    Axes, Blend, Combined, KNOTS, Region, between_knots, combine, disagreement, placed, time_key,
};
use crate::learned::blend::personal::{Personal, lasting};
use crate::learned::blend::places::Places;
use crate::learned::blend::quantiles::{SENSOR_M, sensor, trace, weighted_quantile};
use crate::learned::blend::sources::{Ends, SOURCES};
use crate::learned::blend::turns::{Sums, Turns};
use crate::learned::reaches::samples::TrainingSample;
use crate::learned::regression::local_ridge::Rows;
use glam::{DMat3, DVec3};
use hwall_numeric::parallel;

/// 90 % of a normal variable in three dimensions lie within this Mahalanobis distance, squared.
const CHI_SQUARED_3_90: f64 = 6.251_389;
/// 90 % of a standard normal variable lie within this.
const NORMAL_90: f64 = 1.644_854;
/// Larger errors are clipped to this many times the median: a primitive that loses its way on one
/// reach in a hundred is metres off and would outweigh all others.
const CLIP: f64 = 4.0;
/// Largest squared Mahalanobis distance that counts in a comparison of axes.
const FAR_OUT: f64 = 20.0;
/// Rounds in which the factors on the covariance are found.
const ROUNDS: usize = 3;
/// Bounds of what is added because little was seen: of the quantile of errors, and of the factor on them.
const LEVEL_MOST: f64 = 0.96;
const FEW_MOST: f64 = 1.6;
/// As so many reaches count inputs, ridges, regions and trees, which are chosen on the errors that the covariance is learnt
/// from.
const CHOSEN: f64 = 9.0;

/// Largest squared distance per axis that counts as usual, in standard deviations.
pub(in crate::learned) const MOST_DISTANCE: f64 = 6.0;

/// One sample with what every source says of it when its fold is held out.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Witness {
    pub(in crate::learned) ends_m: Ends,
    /// Estimated and true time left, s.
    pub(in crate::learned) left_s: f64,
    pub(in crate::learned) true_left_s: f64,
}

/// What is learnt from.
pub(in crate::learned) struct Evidence<'a> {
    pub(in crate::learned) samples: &'a [TrainingSample],
    pub(in crate::learned) rows: &'a Rows,
    pub(in crate::learned) witnesses: &'a [Witness],
    pub(in crate::learned) places: Option<&'a Places>,
    /// The person of each sample, by number.
    pub(in crate::learned) people: &'a [usize],
    /// How many reaches were made; those behind them are copies at another pace.
    pub(in crate::learned) made: usize,
    /// The rows that count in each region, and how much.
    pub(in crate::learned) near: Vec<Vec<(usize, f64)>>,
}

/// The rows that count in each region, and how much.
pub(in crate::learned) fn near(samples: &[TrainingSample], rows: &Rows) -> Vec<Vec<(usize, f64)>> {
    let mut near = vec![Vec::new(); rows.regions];
    for (row, sample) in samples.iter().enumerate() {
        for (near, gate) in near.iter_mut().zip(rows.gates(row)) {
            if *gate > 0.0 {
                near.push((row, sample.weight * gate));
            }
        }
    }
    near
}

impl Evidence<'_> {
    fn each(&self) -> impl Iterator<Item = (usize, &TrainingSample, &Witness)> {
        let pairs = self.samples.iter().zip(self.witnesses).enumerate();
        pairs.map(|(row, (sample, witness))| (row, sample, witness))
    }

    fn rows_of(&self, region: usize) -> &[(usize, f64)] {
        &self.near[region]
    }
}

impl Evidence<'_> {
    /// How many reaches there are, by their weights.
    pub(super) fn reaches(&self) -> f64 {
        self.samples.iter().map(|s| s.weight).sum()
    }

    pub(super) fn person_count(&self) -> usize {
        1 + self.people.iter().copied().max().unwrap_or(0)
    }

    fn folds(&self) -> usize {
        self.samples.iter().map(|s| s.fold + 1).max().unwrap_or(0)
    }

    /// Sums over the rows of a region, by fold.
    fn sums<const N: usize>(
        &self,
        region: usize,
        weights: [usize; N],
        values: impl Fn(usize, f64) -> [f64; N],
    ) -> Sums<N> {
        let rows = self.rows_of(region).iter();
        let each = rows.map(|&(row, weight)| (self.samples[row].fold, values(row, weight)));
        Sums::of(self.folds(), weights, each)
    }

    /// Something of every region, worked out on all cores.
    fn of_regions<T: Send>(&self, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        parallel::map(self.rows.regions, of)
    }

    /// Something of every row, worked out on all cores.
    pub(super) fn of_rows<T: Send>(&self, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        /// Rows that one core takes at a time: enough that handing them out costs nothing beside.
        const TOGETHER: usize = 256;
        let count = self.samples.len();
        let parts = parallel::map(count.div_ceil(TOGETHER), |part| {
            let rows = part * TOGETHER..count.min((part + 1) * TOGETHER);
            rows.map(&of).collect::<Vec<_>>()
        });
        parts.into_iter().flatten().collect()
    }

    /// The region of a sample, as learnt mostly from the other folds.
    fn held_out(&self, turns: &Turns, row: usize) -> Region {
        let regions = &turns.without[self.samples[row].fold];
        Region::between(regions, self.rows.gates(row))
    }
}

/// An estimate of one sample, for the learning of its covariance.
struct Judged {
    miss_m: DVec3,
    region: Region,
    axes: DMat3,
    ratio: f64,
    hats: [f64; KNOTS],
}

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

/// A blend with covariances.
struct Calibrated {
    blend: Blend,
    /// Mean log density of the contacts under them.
    score: f64,
    /// As [`HeldOut::optimism`].
    optimism: f64,
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

fn clip(near: &[(usize, f64)], length: &dyn Fn(usize) -> f64) -> f64 {
    let lengths = near.iter().map(|&(row, weight)| (length(row), weight));
    CLIP * weighted_quantile(0.5, lengths)
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

/// The covariances in some axes.
fn calibrated(
    evidence: &Evidence,
    combined: &[Combined],
    points_m: &[DVec3],
    mut turns: Turns,
    axes: Axes,
    independent: f64,
) -> Calibrated {
    let turned: Vec<(DMat3, DVec3)> = evidence
        .each()
        .map(|(row, sample, _)| {
            let axes = axes.of(sample.start_m, points_m[row]);
            (axes, axes.transpose() * (points_m[row] - sample.end_m))
        })
        .collect();
    shape(evidence, &turned, &mut turns);
    let keys = || {
        let each = evidence.each();
        each.map(|(_, sample, witness)| (time_key(witness.left_s), sample.weight))
    };
    let knots: [f64; KNOTS] = std::array::from_fn(|k| {
        weighted_quantile(0.02 + 0.96 * k as f64 / (KNOTS - 1) as f64, keys())
    });
    let mut blend = Blend {
        axes,
        arrival: Arrival::NONE,
        regions: turns.all.clone(),
        by_disagreement: 0.0,
        knots,
        factors: [1.0; KNOTS],
        usual_distances: [1.0; KNOTS],
        personal: Personal::even(0.1),
    };
    let judged: Vec<Judged> = evidence.of_rows(|row| {
        let region = evidence.held_out(&turns, row);
        let usual = region.apart * region.size_m2 + SENSOR_M * SENSOR_M;
        Judged {
            miss_m: turned[row].1,
            ratio: disagreement(combined[row].apart_m2 / usual),
            region,
            axes: turned[row].0,
            hats: between_knots(&knots, time_key(evidence.witnesses[row].left_s)),
        }
    });
    blend.by_disagreement = slope(evidence, &judged);
    let optimism = spread(evidence, &judged, &mut blend, independent);
    Calibrated {
        score: log_score(evidence, &judged, &mut blend),
        blend,
        optimism,
    }
}

/// Second moments of the errors of the estimates, and of the time.
fn shape(evidence: &Evidence, turned: &[(DMat3, DVec3)], turns: &mut Turns) {
    let late = |row: usize| {
        let witness = &evidence.witnesses[row];
        (witness.left_s - witness.true_left_s).abs()
    };
    let sums_of = |region: usize| {
        let near = evidence.rows_of(region);
        let limit = clip(near, &|row| turned[row].1.length());
        let latest = clip(near, &late);
        evidence.sums(region, [7; 8], |row, weight| {
            let m = turned[row].1.clamp_length_max(limit.max(1e-9));
            let time = late(row).min(latest).powi(2);
            let products = [m.x * m.x, m.y * m.y, m.z * m.z, m.x * m.y, m.y * m.z];
            let [xx, yy, zz, xy, yz] = products.map(|p| weight * p);
            let (zx, time) = (weight * m.z * m.x, weight * time);
            [xx, yy, zz, xy, yz, zx, time, weight]
        })
    };
    for (region, sums) in evidence.of_regions(sums_of).iter().enumerate() {
        turns.learn(region, sums, |out, sums| {
            let total = sums[7].max(f64::MIN_POSITIVE);
            let [xx, yy, zz, xy, yz, zx] = std::array::from_fn(|k| sums[k] / total);
            let columns = [xx, xy, zx, xy, yy, yz, zx, yz, zz];
            let moments = DMat3::from_cols_array(&columns) + sensor();
            let size = trace(&moments);
            // What was in units of the old size.
            let ratio = out.size_m2 / size;
            out.moments.iter_mut().flatten().for_each(|m| *m *= ratio);
            out.unplaced *= ratio;
            out.apart *= ratio;
            out.placed *= ratio;
            out.size_m2 = size;
            out.shape = moments * (1.0 / size);
            out.time_s2 = (sums[6] / total).max(1e-8);
        });
    }
}

/// Squared distance of a miss, in standard deviations, before any factor.
fn distance(judged: &Judged) -> f64 {
    let covariance = judged.region.shape * judged.region.size_m2 + sensor();
    judged.miss_m.dot(covariance.inverse() * judged.miss_m)
}

/// By which power of the disagreement the squared distance grows: least squares of the logarithms.
fn slope(evidence: &Evidence, judged: &[Judged]) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut xy) = (f64::MIN_POSITIVE, 0.0, 0.0, 0.0, 0.0);
    for (sample, judged) in evidence.samples.iter().zip(judged) {
        let (a, b) = (judged.ratio.ln(), (distance(judged) + 0.3).ln());
        let w = sample.weight;
        (n, x, y) = (n + w, x + w * a, y + w * b);
        (xx, xy) = (xx + w * a * a, xy + w * a * b);
    }
    let (cross, own) = (xy - x * y / n, xx - x * x / n);
    if own > 1e-6 * n {
        (cross / own).clamp(0.0, 0.8)
    } else {
        0.0
    }
}

/// The factors that make 90 % regions hold 90 % of the errors to come in every region of progress and at every time left. Returns how many
/// times as large they are as for the errors that they are learnt from.
fn spread(evidence: &Evidence, judged: &[Judged], blend: &mut Blend, independent: f64) -> f64 {
    // There are fewer independent errors than reaches, for those of one person are alike. A new error lies below their quantile less
    // often than they do, and a covariance learnt from few is too small for new ones.
    let level = (0.9 * (independent + 1.0) / independent).min(LEVEL_MOST);
    let reaches = evidence.reaches();
    // Weights, inputs and spreads are chosen on the same errors.
    let few = ((reaches + 1.0) / (reaches - CHOSEN).max(1.0)).min(FEW_MOST);
    let plain: Vec<f64> = judged
        .iter()
        .map(|j| few * distance(j) / j.ratio.powf(blend.by_disagreement))
        .collect();
    let near = &evidence.near;
    for _ in 0..ROUNDS {
        let distances = scaled(evidence, judged, blend, &plain);
        let most = evidence.of_regions(|k| {
            let rows = near[k].iter();
            let pairs = rows.map(|&(row, weight)| (distances[row], weight));
            weighted_quantile(level, pairs) / CHI_SQUARED_3_90
        });
        for (region, most) in blend.regions.iter_mut().zip(most) {
            region.spread *= most.clamp(0.05, 20.0);
        }
        let distances = scaled(evidence, judged, blend, &plain);
        for k in 0..KNOTS {
            let pairs = judged.iter().enumerate();
            let pairs =
                pairs.map(|(row, j)| (distances[row], j.hats[k] * evidence.samples[row].weight));
            let most = weighted_quantile(level, pairs.filter(|p| p.1 > 0.0)) / CHI_SQUARED_3_90;
            blend.factors[k] *= most.clamp(0.2, 5.0);
        }
    }
    even(evidence, judged, blend, &plain, level);
    // One after the other: each is judged by what those before it have become.
    let mut logarithms: Vec<f64> = blend.regions.iter().map(|r| r.time_s2.ln()).collect();
    for (k, near) in near.iter().enumerate() {
        let pairs = near.iter().map(|&(row, weight)| {
            let witness = &evidence.witnesses[row];
            let late = (witness.left_s - witness.true_left_s).abs();
            let usual = Region::time_sd_between_s(&logarithms, evidence.rows.gates(row));
            (late / usual, weight)
        });
        let most = weighted_quantile(level, pairs) / NORMAL_90;
        let time_s2 = &mut blend.regions[k].time_s2;
        *time_s2 *= most.clamp(0.1, 10.0).powi(2);
        logarithms[k] = time_s2.ln();
    }
    let at = |level: f64| {
        let each = plain.iter().zip(judged).enumerate();
        let pairs = each.map(|(row, (d, j))| {
            let spread = Region::spread_between(&blend.regions, evidence.rows.gates(row));
            let distance = d / (spread * blend.at_time(&j.hats));
            (distance, evidence.samples[row].weight)
        });
        weighted_quantile(level, pairs)
    };
    let wider = at(level) / at(0.9).max(f64::MIN_POSITIVE);
    few * if wider.is_finite() {
        wider.max(1.0)
    } else {
        1.0
    }
}

/// The distances of all rows under the spreads and factors so far.
fn scaled(evidence: &Evidence, judged: &[Judged], blend: &Blend, plain: &[f64]) -> Vec<f64> {
    let logarithms: Vec<f64> = blend.regions.iter().map(|r| r.spread.ln()).collect();
    evidence.of_rows(|row| {
        let spread = Region::logarithm_between(&logarithms, evidence.rows.gates(row)).exp();
        plain[row] / (spread * blend.at_time(&judged[row].hats))
    })
}

/// Moments at which regions shall hold as many ends as at all others, as shares of the true time of a reach.
const MOMENTS: [f64; 8] = [0.1, 0.25, 0.4, 0.55, 0.7, 0.8, 0.9, 1.0];
/// Rounds in which the factors on the covariance are made even over them.
const EVEN_ROUNDS: usize = 8;
/// So much of that is changed by the progress. With half of it 90 % regions are more even by 1 point in the middle of a reach, but
/// less sharp by 2 % at its end.
const BY_PROGRESS: f64 = 0.4;

/// Changes the spreads and the factors at the times left so that 90 % regions hold 90 % at every true moment, as far as progress
/// and estimated time left tell the moments apart.
fn even(evidence: &Evidence, judged: &[Judged], blend: &mut Blend, plain: &[f64], level: f64) {
    let moments: Vec<usize> = evidence
        .each()
        .map(|(_, sample, witness)| {
            let elapsed_s = sample.progress[0];
            let share = elapsed_s / (elapsed_s + witness.true_left_s).max(1e-9);
            let near = |m: &f64| (m - share).abs();
            let each = MOMENTS.iter().enumerate();
            each.min_by(|a, b| near(a.1).total_cmp(&near(b.1)))
                .map_or(0, |m| m.0)
        })
        .collect();
    for _ in 0..EVEN_ROUNDS {
        let distances = scaled(evidence, judged, blend, plain);
        let missing: [f64; MOMENTS.len()] = std::array::from_fn(|m| {
            let at = moments.iter().enumerate().filter(|(_, at)| **at == m);
            let pairs = at.map(|(row, _)| (distances[row], evidence.samples[row].weight));
            (weighted_quantile(level, pairs) / CHI_SQUARED_3_90)
                .clamp(0.2, 5.0)
                .ln()
        });
        // Partly by the time left, partly by the progress: neither alone tells the moments apart.
        let by = |part: f64, rows: &mut dyn Iterator<Item = (usize, f64)>| {
            let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
            for (row, weight) in rows {
                sum += weight * missing[moments[row]];
                total += weight;
            }
            (part * sum / total).exp()
        };
        for (k, factor) in blend.factors.iter_mut().enumerate() {
            let rows = judged.iter().zip(evidence.samples).enumerate();
            *factor *= by(
                1.0 - BY_PROGRESS,
                &mut rows.map(|(row, (j, s))| (row, j.hats[k] * s.weight)),
            );
        }
        for (k, region) in blend.regions.iter_mut().enumerate() {
            region.spread *= by(BY_PROGRESS, &mut evidence.rows_of(k).iter().copied());
        }
    }
}

/// Mean log density of the misses; those far out count only up to a limit. Sets the usual distances.
fn log_score(evidence: &Evidence, judged: &[Judged], blend: &mut Blend) -> f64 {
    let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
    let mut far = [(0.0, f64::MIN_POSITIVE); KNOTS];
    for (row, j) in judged.iter().enumerate() {
        let weight = evidence.samples[row].weight;
        let spread = Region::spread_between(&blend.regions, evidence.rows.gates(row));
        let factor = spread * blend.at_time(&j.hats) * j.ratio.powf(blend.by_disagreement);
        let covariance = j.region.shape * (j.region.size_m2 * factor) + sensor();
        let distance = j.miss_m.dot(covariance.inverse() * j.miss_m);
        for ((far, total), hat) in far.iter_mut().zip(j.hats) {
            *far += hat * weight * (distance / 3.0).min(MOST_DISTANCE);
            *total += hat * weight;
        }
        sum -= weight * 0.5 * (distance.min(FAR_OUT) + covariance.determinant().ln());
        total += weight;
        debug_assert!(j.axes.is_finite());
    }
    blend.usual_distances = far.map(|(far, total)| (far / total).clamp(0.1, 2.0));
    sum / total
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
