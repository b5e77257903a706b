//! People go further than foreseen, or stop short, each in a way of their own.

use crate::learned::blend::combination::KNOTS;
use glam::DVec3;

/// An older touch counts this much less than the next one.
const FORGETTING: f64 = 0.92;
/// Misses along the way beyond so many standard deviations count as that many.
const MOST_DEVIATIONS: f64 = 3.0;
/// Largest share of the way left that is added to it or taken from it.
const MOST_SHARE: f64 = 0.6;
/// Variances of the share that are tried.
const VARIANCES: [f64; 7] = [0.0, 0.01, 0.025, 0.05, 0.1, 0.2, 0.4];
/// One must lower the mean logarithm of the squared error by this.
const WORTH: f64 = 0.005;
/// Squared errors below this many times the usual are as good as that.
const LEAST_ERROR: f64 = 0.1;

/// The way left, as it is foreseen.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct WayLeft {
    /// From here to there, m.
    pub(in crate::learned) now_m: DVec3,
    pub(in crate::learned) end_m: DVec3,
    /// Usual variance of the end in each axis, m².
    pub(in crate::learned) variance_m2: f64,
}

impl WayLeft {
    fn way_m(&self) -> DVec3 {
        self.end_m - self.now_m
    }

    /// The end, if the way is longer by a share of it, m.
    pub(in crate::learned) fn stretched_m(&self, share: f64) -> DVec3 {
        self.end_m + self.way_m() * share
    }
}

/// Ways left at several instants of one reach, as sums from which the misses along them follow for any place of the contact. So
/// nothing needs to be kept until the contact is known.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Ways {
    /// All is relative to the first place of the hand, so that far from the origin nothing is lost, m.
    origin_m: DVec3,
    /// Sums over the variance: of the way, of its product with the end, and of its square.
    way: DVec3,
    end: f64,
    square: f64,
    count: f64,
}

impl Ways {
    pub(in crate::learned) const NONE: Self = Self {
        origin_m: DVec3::ZERO,
        way: DVec3::ZERO,
        end: 0.0,
        square: 0.0,
        count: 0.0,
    };

    pub(in crate::learned) fn add(&mut self, left: &WayLeft) {
        if self.count == 0.0 {
            self.origin_m = left.now_m;
        }
        let way = left.way_m() / left.variance_m2;
        let end = (left.end_m - self.origin_m).dot(way);
        if way.is_finite() && end.is_finite() {
            self.way += way;
            self.end += end;
            self.square += left.way_m().dot(way);
            self.count += 1.0;
        }
    }
}

/// By which share one person's way left is longer than foreseen: the regression of the misses on the way, as sums in
/// standard deviations, older touches counting less.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Stretch {
    towards: f64,
    square: f64,
}

impl Stretch {
    pub(in crate::learned) const NONE: Self = Self {
        towards: 0.0,
        square: 0.0,
    };

    /// Takes a touch, m, and what was foreseen of it.
    pub(in crate::learned) fn learn(&mut self, ways: &Ways, contact_m: DVec3) {
        let square = ways.square / ways.count;
        let towards = ((contact_m - ways.origin_m).dot(ways.way) - ways.end) / ways.count;
        // Nothing was foreseen, or the contact is nowhere.
        if !(square.is_finite() && towards.is_finite()) {
            return;
        }
        let most = MOST_DEVIATIONS * square.sqrt();
        self.towards = FORGETTING * self.towards + towards.clamp(-most, most);
        self.square = FORGETTING * self.square + square;
    }

    /// The share, where those of people scatter about zero with a variance.
    pub(in crate::learned) fn share(&self, variance: f64) -> f64 {
        let share = variance * self.towards / (1.0 + variance * self.square);
        share.clamp(-MOST_SHARE, MOST_SHARE)
    }
}

/// A reach that was held out.
#[derive(Debug, Clone, Default)]
pub(super) struct StretchedReach {
    /// Number of the person.
    pub(super) person: usize,
    pub(super) contact_m: DVec3,
    /// By time left.
    pub(super) left: [Vec<WayLeft>; KNOTS],
}

/// The variance of the shares among people at each time left: that with which the touches of a person teach most about the
/// next one; 0 where they teach nothing. Reaches of one person are in order.
pub(super) fn variances(people: usize, reaches: &[StretchedReach]) -> [f64; KNOTS] {
    std::array::from_fn(|k| {
        let mut stretches = vec![Stretch::NONE; people];
        let (mut losses, mut count) = ([0.0; VARIANCES.len()], 0.0);
        for reach in reaches {
            let stretch = &mut stretches[reach.person];
            let mut ways = Ways::NONE;
            for left in &reach.left[k] {
                ways.add(left);
                count += 1.0;
                for (loss, variance) in losses.iter_mut().zip(VARIANCES) {
                    let miss_m = left.stretched_m(stretch.share(variance)) - reach.contact_m;
                    *loss += (LEAST_ERROR + miss_m.length_squared() / left.variance_m2).ln();
                }
            }
            stretch.learn(&ways, reach.contact_m);
        }
        let (mut least, mut best) = (losses[0] - WORTH * count, VARIANCES[0]);
        for (loss, variance) in losses.into_iter().zip(VARIANCES) {
            if loss < least {
                (least, best) = (loss, variance);
            }
        }
        best
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    /// 0.2 m ahead of a hand far from the origin, 2 cm unsure.
    fn ahead(sampler: &mut Sampler) -> WayLeft {
        let now_m = DVec3::new(40.0, -7.0, 1.0) + DVec3::splat(0.1 * sampler.normal());
        WayLeft {
            now_m,
            end_m: now_m + DVec3::new(0.2, 0.0, 0.02 * sampler.normal()),
            variance_m2: 4e-4,
        }
    }

    fn contact_m(left: &WayLeft, share: f64, sampler: &mut Sampler) -> DVec3 {
        let noise = DVec3::from_array(std::array::from_fn(|_| 0.01 * sampler.normal()));
        left.stretched_m(share) + noise
    }

    #[test]
    fn the_share_of_one_person_is_found_and_no_more_than_is_there() {
        let mut sampler = Sampler::new(1);
        for share in [-0.2, 0.0, 0.3] {
            let mut stretch = Stretch::NONE;
            assert_eq!(stretch.share(0.1), 0.0);
            for _ in 0..80 {
                let left = ahead(&mut sampler);
                let mut ways = Ways::NONE;
                ways.add(&left);
                ways.add(&left);
                stretch.learn(&ways, contact_m(&left, share, &mut sampler));
            }
            let found = stretch.share(0.1);
            assert!((found - share).abs() < 0.04, "{found} of {share}");
            assert_eq!(stretch.share(0.0), 0.0);
        }
    }

    #[test]
    fn nothing_is_learnt_from_nothing_and_one_wild_reach_hardly_counts() {
        let mut sampler = Sampler::new(2);
        let left = ahead(&mut sampler);
        let mut ways = Ways::NONE;
        let mut stretch = Stretch::NONE;
        stretch.learn(&ways, left.end_m);
        ways.add(&left);
        ways.add(&WayLeft {
            variance_m2: 0.0,
            ..left
        });
        ways.add(&WayLeft {
            end_m: DVec3::NAN,
            ..left
        });
        stretch.learn(&ways, DVec3::NAN);
        assert_eq!((stretch.towards, stretch.square), (0.0, 0.0));
        stretch.learn(&ways, left.now_m + DVec3::X * 5.0);
        assert!(stretch.share(0.05) < 0.3, "{stretch:?}");
    }

    #[test]
    fn people_who_differ_are_told_from_those_who_do_not() {
        let mut sampler = Sampler::new(3);
        let mut reaches = |scatter: f64| -> Vec<StretchedReach> {
            let mut all = Vec::new();
            for person in 0..12 {
                let share = scatter * sampler.normal();
                for _ in 0..20 {
                    let left = ahead(&mut sampler);
                    let mut reach = StretchedReach {
                        person,
                        contact_m: contact_m(&left, share, &mut sampler),
                        ..StretchedReach::default()
                    };
                    reach.left[2].push(left);
                    all.push(reach);
                }
            }
            all
        };
        let differ = variances(12, &reaches(0.3));
        assert!((0.025..=0.4).contains(&differ[2]), "{differ:?}");
        assert_eq!(differ[0], 0.0);
        assert_eq!(variances(12, &reaches(0.0)), [0.0; KNOTS]);
    }
}
