//! Covariance of a combination of sources, learned from its errors on held-out reaches.

use crate::learned::blend::arrival::Arrival;
use crate::learned::blend::combination::{Axes, Blend, Combined, Personal, Region, disagreement};
use crate::learned::blend::evidence::{Evidence, clip};
use crate::learned::blend::knots::{KNOTS, between_knots, time_key};
use crate::learned::blend::turns::Turns;
use crate::learned::quantiles::{SENSOR_M, sensor, weighted_quantile};
use crate::matrices::trace;
use glam::{DMat3, DVec3};

/// Squared Mahalanobis distance that contains 90 % of a normal variable in three dimensions.
const CHI_SQUARED_3_90: f64 = 6.251_389;
/// Bound that contains 90 % of a standard normal variable, either side.
const NORMAL_90: f64 = 1.644_854;
/// Largest squared Mahalanobis distance that counts when axes are compared.
const FAR_OUT: f64 = 20.0;
/// Iterations for the factors on the covariance.
const ROUNDS: usize = 3;
/// Bounds of the small-sample corrections: of the quantile of errors, and of the factor on them.
const LEVEL_MOST: f64 = 0.96;
const FEW_MOST: f64 = 1.6;
/// Effective number of parameters, in reaches: inputs, ridges, regions and trees are chosen on the same errors that the covariance is learned from.
const CHOSEN: f64 = 9.0;

/// Largest squared distance per axis that counts in the typical distance, in standard deviations.
pub(super) const MOST_DISTANCE: f64 = 6.0;

/// The error of one sample, for learning its covariance.
struct Judged {
    miss_m: DVec3,
    region: Region,
    ratio: f64,
    hats: [f64; KNOTS],
}

/// A blend with covariances.
pub(super) struct Calibrated {
    pub(super) blend: Blend,
    /// Mean log density of the contacts under them.
    pub(super) score: f64,
    /// Ratio of the stated covariances to the held-out errors: larger than 1, because errors on new reaches are larger.
    pub(super) optimism: f64,
}

/// A blend with its covariances in the given axes.
pub(super) fn calibrated(
    evidence: &Evidence,
    combined: &[Combined],
    points_m: &[DVec3],
    mut turns: Turns,
    axes: Axes,
    independent: f64,
) -> Calibrated {
    let turned: Vec<DVec3> = evidence
        .each()
        .map(|(row, sample, _)| {
            let axes = axes.of(sample.start_m, points_m[row]);
            axes.transpose() * (points_m[row] - sample.end_m)
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
        typical_distances: [1.0; KNOTS],
        personal: Personal::even(0.1),
    };
    let judged: Vec<Judged> = evidence.of_rows(|row| {
        let region = evidence.held_out(&turns, row);
        let typical = region.apart * region.size_m2 + SENSOR_M * SENSOR_M;
        Judged {
            miss_m: turned[row],
            ratio: disagreement(combined[row].apart_m2 / typical),
            region,
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

/// Second moments of the errors of the estimates and of the time left.
fn shape(evidence: &Evidence, turned: &[DVec3], turns: &mut Turns) {
    let late = |row: usize| {
        let witness = &evidence.witnesses[row];
        (witness.left_s - witness.true_left_s).abs()
    };
    let sums_of = |region: usize| {
        let near = evidence.rows_of(region);
        let limit = clip(near, &|row| turned[row].length());
        let latest = clip(near, &late);
        evidence.sums(region, [7; 8], |row, weight| {
            let m = turned[row].clamp_length_max(limit.max(1e-9));
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
            // Rescale quantities given in units of the old size.
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

/// Squared Mahalanobis distance of a miss, before any factor.
fn distance(judged: &Judged) -> f64 {
    let covariance = judged.region.shape * judged.region.size_m2 + sensor();
    judged.miss_m.dot(covariance.inverse() * judged.miss_m)
}

/// Power of the disagreement with which the squared distance grows: least squares of the logarithms.
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

/// Factors that give 90 % regions a coverage of 90 % on new errors, in every region of progress and at every time left. Returns their ratio to the
/// factors for the training errors.
fn spread(evidence: &Evidence, judged: &[Judged], blend: &mut Blend, independent: f64) -> f64 {
    // Errors of one person are correlated, so there are fewer independent errors than reaches. A new error lies below a quantile of the known
    // errors less often than the known errors do, and a covariance learned from few errors is too small for new ones.
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
    // Sequentially: each one is evaluated with the values of those before it.
    let mut logarithms: Vec<f64> = blend.regions.iter().map(|r| r.time_s2.ln()).collect();
    for (k, near) in near.iter().enumerate() {
        let pairs = near.iter().map(|&(row, weight)| {
            let witness = &evidence.witnesses[row];
            let late = (witness.left_s - witness.true_left_s).abs();
            let typical = Region::time_sd_between_s(&logarithms, evidence.rows.gates(row));
            (late / typical, weight)
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

/// Squared distances of all rows under the present spreads and factors.
fn scaled(evidence: &Evidence, judged: &[Judged], blend: &Blend, plain: &[f64]) -> Vec<f64> {
    let logarithms: Vec<f64> = blend.regions.iter().map(|r| r.spread.ln()).collect();
    evidence.of_rows(|row| {
        let spread = Region::logarithm_between(&logarithms, evidence.rows.gates(row)).exp();
        plain[row] / (spread * blend.at_time(&judged[row].hats))
    })
}

/// Moments at which coverage is equalised, as shares of the true duration of a reach.
const MOMENTS: [f64; 8] = [0.1, 0.25, 0.4, 0.55, 0.7, 0.8, 0.9, 1.0];
/// Iterations of the equalisation.
const EVEN_ROUNDS: usize = 8;
/// Share of the equalisation applied by progress. At 0.5, 90 % regions are more even by 1 point in the middle of a reach, but less sharp by 2 % at
/// its end.
const BY_PROGRESS: f64 = 0.4;

/// Changes the spreads and the factors at the times left so that 90 % regions contain 90 % of the contacts at every true moment, as far as progress
/// and estimated time left can distinguish the moments.
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
        // Partly by time left, partly by progress: neither alone distinguishes the moments.
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

/// Mean log density of the misses, with outliers clipped. Also sets the typical distances.
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
    }
    blend.typical_distances = far.map(|(far, total)| (far / total).clamp(0.1, 2.0));
    sum / total
}
