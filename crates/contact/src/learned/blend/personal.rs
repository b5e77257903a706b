//! How much of what is off in an estimate is a person's own: learnt from people held out, for what touches then teach.

use crate::learned::blend::combination::{
    Blend, Combined, KNOTS, Region, between_knots, nearest_knot, time_key,
};
use crate::learned::blend::evidence::Evidence;
use crate::learned::blend::habit::{ForeseenReach, Habits, WayLeft, habits};
use crate::learned::blend::sources::SOURCES;
use glam::DVec3;

/// The share that lasts where only one person is known.
const UNKNOWN_SHARE: f64 = 0.03;
/// Misses count up to this many times the usual.
const CLIP: f64 = 4.0;
/// Bounds of a share.
const SHARES: [f64; 2] = [0.02, 0.9];

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

    /// From what was foreseen of reaches held out.
    pub(super) fn of(evidence: &Evidence, combined: &[Combined], blend: &Blend) -> Self {
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
            // Every reach passes all times left, so the weights at each add up to the number of reaches.
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
    let mut reaches = vec![ForeseenReach::default(); evidence.made];
    for (row, sample) in evidence.samples.iter().enumerate() {
        // Behind them are copies at another pace.
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

/// The share of errors, in units of their usual size, that stays the same from reach to reach of one person: variance
/// of the means of people, less what the mean of so many reaches has by chance. The weights of samples count so many `times`.
pub(super) fn lasting(
    evidence: &Evidence,
    times: f64,
    miss: impl Fn(usize) -> Option<DVec3>,
) -> f64 {
    // Sums of the errors, of their squares and of the weights.
    let mut sums = vec![(DVec3::ZERO, 0.0, 0.0); evidence.person_count()];
    for (row, sample) in evidence.samples.iter().enumerate() {
        let Some(miss) = miss(row).filter(|m| m.is_finite()) else {
            continue;
        };
        let (miss, weight) = (miss.clamp_length_max(CLIP), times * sample.weight);
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
