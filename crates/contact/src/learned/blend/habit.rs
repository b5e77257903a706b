//! Personal deviations from the predicted end: further or less far, bowed to one side, up or down.

use crate::learned::blend::knots::KNOTS;
use glam::{DMat3, DVec3};

/// Weight of an older touch relative to the next one.
const FORGETTING: f64 = 0.98;
/// Largest mean miss of one reach that counts, in standard deviations of an axis.
const MOST_MISS: f64 = 4.0;
/// Longest correction, in standard deviations of an axis.
const MOST_CORRECTION: f64 = 2.0;
/// Largest deviation of a remaining displacement from the mean that counts, in standard deviations.
const MOST_UNUSUAL: f64 = 3.0;
/// Candidate variances of the offsets and of the slopes.
const OFFSETS: [f64; 5] = [0.0, 0.03, 0.1, 0.2, 0.4];
const SLOPES: [f64; 5] = [0.0, 0.01, 0.03, 0.06, 0.12];
const TRIED: usize = OFFSETS.len() * SLOPES.len();
/// A candidate must lower the mean logarithm of the squared error by this much.
const WORTH: f64 = 0.005;
/// Squared errors below this multiple of the expected one are raised to it.
const LEAST_ERROR: f64 = 0.1;
/// The constant and the three axes of the remaining displacement.
const TERMS: usize = 4;

/// A predicted remaining displacement.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct WayLeft {
    /// Present position and predicted end, m.
    pub(in crate::learned) now_m: DVec3,
    pub(in crate::learned) end_m: DVec3,
    /// Expected variance of the end in each axis, m².
    pub(in crate::learned) variance_m2: f64,
}

impl WayLeft {
    /// The end after a correction in standard deviations, m.
    pub(in crate::learned) fn corrected_m(&self, by: DVec3) -> DVec3 {
        self.end_m + by * self.variance_m2.sqrt()
    }
}

/// Prior over people at one time left: how their misses, in standard deviations, depend on the remaining displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Habits {
    /// Mean remaining displacement, m, and its standard deviation per axis, m.
    pub(in crate::learned) typical_m: DVec3,
    pub(in crate::learned) scatter_m: f64,
    /// Variances between people of the offset and of the slopes.
    pub(in crate::learned) offset: f64,
    pub(in crate::learned) slope: f64,
}

impl Habits {
    /// No differences between people, or none known.
    pub(in crate::learned) const NONE: Self = Self {
        typical_m: DVec3::ZERO,
        scatter_m: 1.0,
        offset: 0.0,
        slope: 0.0,
    };

    /// 1, and the normalised deviation of the remaining displacement from the mean.
    fn terms(&self, left: &WayLeft) -> [f64; TERMS] {
        let unusual = (left.end_m - left.now_m - self.typical_m) / self.scatter_m;
        let most = DVec3::splat(MOST_UNUSUAL);
        let [x, y, z] = unusual.clamp(-most, most).to_array();
        [1.0, x, y, z]
    }
}

/// Remaining displacements at several times of one reach, as sums that give the misses for any contact, so that no estimates need to be
/// stored until the contact is known.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Ways {
    /// First position of the hand; everything else is relative to it, which avoids rounding errors far from the origin, m.
    origin_m: DVec3,
    /// Sums of the products of the terms; of the terms over the standard deviation; and of the latter times the end.
    products: [[f64; TERMS]; TERMS],
    terms: [f64; TERMS],
    ends: [DVec3; TERMS],
    weight: f64,
}

impl Ways {
    pub(in crate::learned) const NONE: Self = Self {
        origin_m: DVec3::ZERO,
        products: [[0.0; TERMS]; TERMS],
        terms: [0.0; TERMS],
        ends: [DVec3::ZERO; TERMS],
        weight: 0.0,
    };

    pub(in crate::learned) fn add(&mut self, habits: &Habits, left: &WayLeft, weight: f64) {
        let each_m = 1.0 / left.variance_m2.sqrt();
        let terms = habits.terms(left);
        let there = left.now_m.is_finite() && left.end_m.is_finite() && each_m.is_finite();
        if !there || weight <= 0.0 {
            return;
        }
        if self.weight == 0.0 {
            self.origin_m = left.now_m;
        }
        let end_m = left.end_m - self.origin_m;
        for (k, term) in terms.iter().enumerate() {
            for (product, other) in self.products[k].iter_mut().zip(&terms) {
                *product += weight * term * other;
            }
            let scaled = weight * term * each_m;
            self.terms[k] += scaled;
            self.ends[k] += end_m * scaled;
        }
        self.weight += weight;
    }
}

/// Regression sums of one person's habit over their touches, discounted with age.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Habit {
    products: [[f64; TERMS]; TERMS],
    misses: [DVec3; TERMS],
    /// The offset and the slopes along the axes of the displacement, in standard deviations.
    found: [DVec3; TERMS],
}

impl Habit {
    pub(in crate::learned) const UNKNOWN: Self = Self {
        products: [[0.0; TERMS]; TERMS],
        misses: [DVec3::ZERO; TERMS],
        found: [DVec3::ZERO; TERMS],
    };

    /// Updates from a touch, m, and its predictions.
    pub(in crate::learned) fn learn(&mut self, habits: &Habits, ways: &Ways, contact_m: DVec3) {
        if self.add(ways, contact_m) {
            self.found = self.solved(habits.offset, habits.slope);
        }
    }

    /// `false` if there was no prediction, or the contact is not finite.
    fn add(&mut self, ways: &Ways, contact_m: DVec3) -> bool {
        let contact_m = contact_m - ways.origin_m;
        // A touch counts once, however many predictions preceded it.
        let each = 1.0 / ways.weight.max(1.0);
        let mut misses = ways.ends;
        for (miss, term) in misses.iter_mut().zip(&ways.terms) {
            *miss = (contact_m * *term - *miss) * each;
        }
        let size = misses[0].length() / (ways.weight * each);
        if !(ways.weight > 0.0 && size.is_finite()) {
            return false;
        }
        let less = MOST_MISS / size.max(MOST_MISS);
        let own = self.products.iter_mut().flatten();
        for (own, new) in own.zip(ways.products.iter().flatten()) {
            *own = FORGETTING * *own + new * each;
        }
        for (own, new) in self.misses.iter_mut().zip(misses) {
            *own = *own * FORGETTING + new * less;
        }
        true
    }

    /// Regression whose coefficients have these prior variances about zero: `(PᵀP + V⁻¹)⁻¹ Pᵀm`, in a form that allows a variance of zero.
    fn solved(&self, offset: f64, slope: f64) -> [DVec3; TERMS] {
        let sds = [offset, slope, slope, slope].map(f64::sqrt);
        let mut lower = [[0.0_f64; TERMS]; TERMS];
        let mut found = [DVec3::ZERO; TERMS];
        // Cholesky; the matrix is the identity plus a positive semidefinite one.
        for i in 0..TERMS {
            for j in 0..=i {
                let mut sum = sds[i] * self.products[i][j] * sds[j];
                sum += f64::from(u8::from(i == j));
                let before = lower[i].iter().zip(&lower[j]).take(j);
                sum -= before.map(|(a, b)| a * b).sum::<f64>();
                lower[i][j] = match i == j {
                    true => sum.max(1e-9).sqrt(),
                    false => sum / lower[j][j],
                };
            }
            let before = (0..i).map(|k| found[k] * lower[i][k]).sum::<DVec3>();
            found[i] = (self.misses[i] * sds[i] - before) / lower[i][i];
        }
        for i in (0..TERMS).rev() {
            let behind = (i + 1..TERMS)
                .map(|k| found[k] * lower[k][i])
                .sum::<DVec3>();
            found[i] = (found[i] - behind) / lower[i][i];
        }
        std::array::from_fn(|k| found[k] * sds[k])
    }

    /// Deviation of this person's end, in standard deviations.
    pub(in crate::learned) fn correction(&self, habits: &Habits, left: &WayLeft) -> DVec3 {
        corrected(&self.found, habits, left)
    }
}

fn corrected(found: &[DVec3; TERMS], habits: &Habits, left: &WayLeft) -> DVec3 {
    let [one, x, y, z] = habits.terms(left);
    let slopes = DMat3::from_cols(found[1], found[2], found[3]);
    let by = found[0] * one + slopes * DVec3::new(x, y, z);
    by.clamp_length_max(MOST_CORRECTION)
}

/// A held-out reach.
#[derive(Debug, Clone, Default)]
pub(super) struct PredictedReach {
    /// Number of the person.
    pub(super) person: usize,
    pub(super) contact_m: DVec3,
    /// Predictions by time left, with their weights there.
    pub(super) left: [Vec<(WayLeft, f64)>; KNOTS],
}

/// The habits at each time left, with the prior variances with which a person's touches best predict the next touch; 0 where they do not
/// help. The reaches of each person must be in order. One person alone gives no information about differences between people.
pub(super) fn habits(people: usize, reaches: &[PredictedReach]) -> [Habits; KNOTS] {
    std::array::from_fn(|k| {
        let mut habits = typical(reaches, k);
        if people < 2 {
            return habits;
        }
        let mut of_people = vec![Habit::UNKNOWN; people];
        let (mut losses, mut count) = ([0.0; TRIED], 0.0);
        let tried = |t: usize| (OFFSETS[t / SLOPES.len()], SLOPES[t % SLOPES.len()]);
        for reach in reaches {
            let habit = &mut of_people[reach.person];
            let mut ways = Ways::NONE;
            let found: [_; TRIED] = std::array::from_fn(|t| habit.solved(tried(t).0, tried(t).1));
            for (left, weight) in &reach.left[k] {
                ways.add(&habits, left, *weight);
                count += weight;
                for (loss, found) in losses.iter_mut().zip(&found) {
                    let by = corrected(found, &habits, left);
                    let miss_m = left.corrected_m(by) - reach.contact_m;
                    let square = miss_m.length_squared() / left.variance_m2;
                    *loss += weight * (LEAST_ERROR + square).ln();
                }
            }
            habit.add(&ways, reach.contact_m);
        }
        let (mut least, mut best) = (losses[0] - WORTH * count, 0);
        for (t, loss) in losses.into_iter().enumerate() {
            if loss < least {
                (least, best) = (loss, t);
            }
        }
        (habits.offset, habits.slope) = tried(best);
        habits
    })
}

/// Mean remaining displacement at a time left.
fn typical(reaches: &[PredictedReach], k: usize) -> Habits {
    let each = || reaches.iter().flat_map(|r| &r.left[k]);
    let mean = |of: &dyn Fn(DVec3) -> DVec3| -> DVec3 {
        let (mut sum, mut total) = (DVec3::ZERO, f64::MIN_POSITIVE);
        for (left, weight) in each() {
            sum += of(left.end_m - left.now_m) * *weight;
            total += weight;
        }
        sum / total
    };
    let typical_m = mean(&|way_m| way_m);
    let square_m2 = mean(&|way_m| (way_m - typical_m).powf(2.0)).element_sum() / 3.0;
    Habits {
        typical_m,
        scatter_m: square_m2.sqrt().max(1e-3),
        ..Habits::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    const SD_M: f64 = 0.02;

    fn drawn(sampler: &mut Sampler, size: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| size * sampler.normal()))
    }

    /// An end about 0.2 m ahead of a hand far from the origin, with a standard deviation of 2 cm.
    fn ahead(sampler: &mut Sampler) -> WayLeft {
        let now_m = DVec3::new(40.0, -7.0, 1.0) + drawn(sampler, 0.1);
        WayLeft {
            now_m,
            end_m: now_m + DVec3::new(0.2, 0.0, 0.0) + drawn(sampler, 0.06),
            variance_m2: SD_M * SD_M,
        }
    }

    #[test]
    fn nothing_is_learnt_from_nothing_and_one_wild_reach_hardly_counts() {
        let mut sampler = Sampler::new(2);
        let habits = Habits {
            typical_m: DVec3::new(0.2, 0.0, 0.0),
            scatter_m: 0.06,
            offset: 0.3,
            slope: 0.06,
        };
        let left = ahead(&mut sampler);
        let (mut ways, mut habit) = (Ways::NONE, Habit::UNKNOWN);
        habit.learn(&habits, &ways, left.end_m);
        ways.add(&habits, &left, 1.0);
        let mut bad = [left; 2];
        bad[0].variance_m2 = 0.0;
        bad[1].end_m = DVec3::NAN;
        bad.iter().for_each(|bad| ways.add(&habits, bad, 1.0));
        habit.learn(&habits, &ways, DVec3::NAN);
        habit.learn(&habits, &ways, DVec3::splat(f64::INFINITY));
        assert_eq!(habit.correction(&habits, &left), DVec3::ZERO);
        habit.learn(&habits, &ways, left.now_m + DVec3::X * 1e6);
        let by = habit.correction(&habits, &left).length();
        assert!(by > 0.0 && by <= MOST_CORRECTION, "{by}");
        for _ in 0..20 {
            habit.learn(&habits, &ways, left.end_m);
        }
        assert!(habit.correction(&habits, &left).length() < 0.3);
        // Without differences between people there is no correction.
        habit.learn(&Habits::NONE, &ways, left.end_m + DVec3::Y);
        assert_eq!(habit.correction(&Habits::NONE, &left), DVec3::ZERO);
    }

    #[test]
    fn people_who_differ_are_told_from_those_who_do_not() {
        let mut sampler = Sampler::new(3);
        let mut reaches = |scatter: f64| -> Vec<PredictedReach> {
            let mut all = Vec::new();
            for person in 0..12 {
                let share = scatter * sampler.normal();
                for _ in 0..20 {
                    let left = ahead(&mut sampler);
                    // Some bow to the left by a share of the distance.
                    let bow_m = DVec3::Z.cross(left.end_m - left.now_m) * share;
                    let mut reach = PredictedReach {
                        person,
                        contact_m: left.end_m + bow_m + drawn(&mut sampler, 0.5 * SD_M),
                        ..PredictedReach::default()
                    };
                    reach.left[2].push((left, 1.0));
                    all.push(reach);
                }
            }
            all
        };
        let differ = habits(12, &reaches(0.15));
        assert!(differ[2].offset > 0.0, "{differ:?}");
        assert!(differ[2].slope > 0.0, "{differ:?}");
        assert!((differ[2].scatter_m - 0.06).abs() < 0.01, "{differ:?}");
        assert_eq!((differ[0].offset, differ[0].slope), (0.0, 0.0));
        for none in habits(12, &reaches(0.0)) {
            assert_eq!((none.offset, none.slope), (0.0, 0.0));
        }
    }
}
