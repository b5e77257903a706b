//! Adaptation to the touches of one person in one room.

use crate::learned::blend::calibration::MOST_DISTANCE;
use crate::learned::blend::combination::{Blend, Personal, Region};
use crate::learned::blend::habit::{Habit, WayLeft, Ways};
use crate::learned::blend::knots::{KNOTS, nearest_knot};
use crate::learned::blend::lateness::{DRIFT, Lateness};
use crate::learned::blend::misses::Misses;
use crate::learned::blend::places::OWN_ENDS;
use crate::learned::blend::sources::{Ends, SOURCES};
use glam::{DMat3, DVec3};

/// Weight of an older touch relative to the next one.
const FORGETTING: f64 = 0.92;
/// Weight of the prior from training, as a number of touches: for the sizes of the sources' errors (past sizes say little about the next ones),
/// for the spread at all times left, for the spread at one time left, and for the share of the places.
const PRIOR_RATIO: f64 = 40.0;
const PRIOR_SPREAD: f64 = 6.0;
const PRIOR_STAGE: f64 = 12.0;
const PRIOR_SHARE: f64 = 4.0;
/// Largest squared error that counts, relative to the expected one.
const MOST_RATIO: f64 = 60.0;
/// A squared error above this multiple of the expected one is a surprise. A single surprise is an outlier. Two surprises whose difference is
/// below the share `ALIKE` of their length show that the room has moved.
const SURPRISE: f64 = 9.0;
const ALIKE: f64 = 0.5;
/// Sources that must agree before a jump is assumed at all times left.
const AGREEING: usize = 2;
/// Variance of a persistent error, as a share of the expected mean square, above which a jump is still being followed.
const SETTLED: f64 = 1.0;
/// Largest share of one error that is attributed to a persistent error.
const MOST_GAIN: f64 = 0.7;
/// Least weight of the latest of several estimates at about the same time left.
const LATEST: f64 = 0.2;
/// Bounds of the factor on the covariance.
const SPREADS: [f64; 2] = [0.4, 12.0];
/// Bounds of the additional factor at one time left.
const STAGE_SPREADS: [f64; 2] = [0.3, 4.0];

/// An estimate kept until the contact shows its error.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Pending {
    /// End predicted by each source, before any correction, m. This and the next two are means over estimates at about the same time left.
    pub(in crate::learned) ends_m: Ends,
    /// Expected mean square of the error of each source, m².
    pub(in crate::learned) squares_m2: [f64; SOURCES],
    /// Predicted contact time before any correction, s, and the expected mean square of its error, s².
    pub(in crate::learned) contact_s: f64,
    pub(in crate::learned) time_s2: f64,
    /// Predicted remaining displacement, before the habit.
    pub(in crate::learned) left: WayLeft,
    /// The combination, the places near it, and the final estimate, m.
    pub(in crate::learned) combined_m: DVec3,
    pub(in crate::learned) placed_m: Option<DVec3>,
    pub(in crate::learned) said_m: DVec3,
    /// Expected squared distance to the places, m².
    pub(in crate::learned) way_m2: f64,
    /// Covariance of the error as learned in training, m².
    pub(in crate::learned) covariance_m2: DMat3,
}

/// State at one value of the time left.
#[derive(Debug, Clone, Copy)]
struct Stage {
    /// Persistent error of each source, m, and its variance as a share of the source's mean square.
    bias_m: [DVec3; SOURCES],
    doubt: [f64; SOURCES],
    /// The last error of each source if it was a surprise, m.
    odd_m: [Option<DVec3>; SOURCES],
    /// Sums over touches, discounted with age: squared errors over the expected ones, and the count.
    ratio: [f64; SOURCES],
    touches: f64,
    /// Sums for the share of the displacement to the places.
    towards: f64,
    way: f64,
    habit: Habit,
    late: Lateness,
    /// Factor on the variance of errors at this time left, relative to the one at all times left.
    spread: f64,
}

/// Adaptation to the touches of one person in one room.
#[derive(Debug, Clone)]
pub(in crate::learned) struct Adaptation {
    stages: [Stage; KNOTS],
    /// Estimates of the present reach.
    said: Said,
    /// Estimates of the previous reach, until the next one is confirmed.
    before: Option<Said>,
    /// Factor on the variance of errors at all times left, relative to training, and the number of touches behind it, discounted with age.
    spread: f64,
    judged: f64,
    /// The last touches, m, in a ring buffer.
    own_m: [DVec3; OWN_ENDS],
    touches: usize,
    /// Recent squared errors over the expected ones.
    surprise: f64,
}

/// Estimates of one reach.
#[derive(Debug, Clone, Copy)]
struct Said {
    /// The last estimate at each time left, with means over those there.
    pending: [Option<Pending>; KNOTS],
    /// Number of estimates.
    counts: [f64; KNOTS],
    /// Over all estimates.
    misses: [Misses; KNOTS],
    ways: [Ways; KNOTS],
}

impl Said {
    const NOTHING: Self = Self {
        pending: [None; KNOTS],
        counts: [0.0; KNOTS],
        misses: [Misses::NONE; KNOTS],
        ways: [Ways::NONE; KNOTS],
    };
}

/// Corrections at one time left.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Adapted {
    pub(in crate::learned) bias_m: [DVec3; SOURCES],
    pub(in crate::learned) ratios: [f64; SOURCES],
    pub(in crate::learned) spread: f64,
    /// Expected delay of the contact, s, and the factor on the variance of the time left.
    pub(in crate::learned) late_s: f64,
    pub(in crate::learned) time_spread: f64,
}

impl Adaptation {
    pub(in crate::learned) fn new(personal: &Personal) -> Self {
        let stage = |k: usize| Stage {
            bias_m: [DVec3::ZERO; SOURCES],
            doubt: personal.lasting(k),
            odd_m: [None; SOURCES],
            ratio: [0.0; SOURCES],
            touches: 0.0,
            towards: 0.0,
            way: 0.0,
            habit: Habit::UNKNOWN,
            late: Lateness::unknown(personal.time[k]),
            spread: 1.0,
        };
        Self {
            stages: std::array::from_fn(stage),
            said: Said::NOTHING,
            before: None,
            spread: 1.0,
            judged: 0.0,
            own_m: [DVec3::ZERO; OWN_ENDS],
            touches: 0,
            surprise: 1.0,
        }
    }

    pub(in crate::learned) fn begin(&mut self) {
        self.said = Said::NOTHING;
        self.before = None;
    }

    /// A reach may have begun; a touch still belongs to the previous reach.
    pub(in crate::learned) fn begin_tentatively(&mut self) {
        let said = std::mem::replace(&mut self.said, Said::NOTHING);
        self.before.get_or_insert(said);
    }

    pub(in crate::learned) fn confirm(&mut self) {
        self.before = None;
    }

    pub(in crate::learned) const fn touches(&self) -> usize {
        self.touches
    }

    pub(in crate::learned) const fn surprise(&self) -> f64 {
        self.surprise
    }

    /// The last touches, m.
    pub(in crate::learned) fn own_m(&self) -> &[DVec3] {
        &self.own_m[..self.touches.min(OWN_ENDS)]
    }

    /// Corrections, interpolated between stages by the weights of the knots.
    pub(in crate::learned) fn at(&self, hats: &[f64; KNOTS]) -> Adapted {
        let mut out = Adapted {
            bias_m: [DVec3::ZERO; SOURCES],
            ratios: [0.0; SOURCES],
            spread: 0.0,
            late_s: 0.0,
            time_spread: 0.0,
        };
        for (stage, &hat) in self.stages.iter().zip(hats) {
            if hat <= 0.0 {
                continue;
            }
            for k in 0..SOURCES {
                out.bias_m[k] += stage.bias_m[k] * hat;
                out.ratios[k] +=
                    hat * (PRIOR_RATIO + stage.ratio[k]) / (PRIOR_RATIO + stage.touches);
            }
            out.spread += hat * (self.spread * stage.spread).clamp(SPREADS[0], SPREADS[1]);
            out.late_s += hat * stage.late.mean_s;
            out.time_spread += hat * stage.late.variance();
        }
        out
    }

    /// End of the remaining displacement, corrected by the habit of this person, m.
    pub(in crate::learned) fn by_habit_m(
        &self,
        hats: &[f64; KNOTS],
        personal: &Personal,
        left: &WayLeft,
    ) -> DVec3 {
        let mut by = DVec3::ZERO;
        for ((stage, habits), &hat) in self.stages.iter().zip(&personal.habits).zip(hats) {
            if hat > 0.0 {
                by += stage.habit.correction(habits, left) * hat;
            }
        }
        left.corrected_m(by)
    }

    /// Share of the distance to the places: from training, updated by the touches since.
    pub(in crate::learned) fn share(&self, hats: &[f64; KNOTS], learnt: f64) -> f64 {
        let shares = self.stages.iter().map(|stage| {
            let share = (PRIOR_SHARE * learnt + stage.towards) / (PRIOR_SHARE + stage.way);
            share.clamp(0.0, 1.0)
        });
        shares.zip(hats).map(|(s, h)| s * h).sum()
    }

    /// Remembers an estimate. Among estimates at about the same time left, only the last counts for the places, and later ones weigh more for
    /// the sources. All weigh the same for the spread and the habit, because errors before a knot differ from errors after it.
    pub(in crate::learned) fn remember(
        &mut self,
        hats: &[f64; KNOTS],
        personal: &Personal,
        pending: Pending,
    ) {
        let nearest = nearest_knot(hats);
        let said = &mut self.said;
        said.misses[nearest].add(pending.said_m, pending.covariance_m2);
        for ((ways, habits), &hat) in said.ways.iter_mut().zip(&personal.habits).zip(hats) {
            ways.add(habits, &pending.left, hat);
        }
        said.counts[nearest] += 1.0;
        let latest = (1.0 / said.counts[nearest]).max(LATEST);
        let before = said.pending[nearest].as_ref();
        said.pending[nearest] = Some(before.map_or(pending, |b| pending.averaged(b, latest)));
    }

    /// The reach ended with a touch at `contact_m`, m, at `contact_s`, s.
    pub(in crate::learned) fn touched(&mut self, contact_m: DVec3, contact_s: f64, blend: &Blend) {
        let (mut surprise, mut counted, mut judged) = (0.0, 0.0, 0.0);
        let said = self.before.as_mut().unwrap_or(&mut self.said);
        let each = said.pending.iter_mut().zip(&mut said.ways);
        let mut jump_m2 = 0.0;
        // Least time left first: a jump is clearest where predictions are best, and it affects all times left.
        for (k, (pending, ways)) in each.enumerate() {
            let stage = &mut self.stages[k];
            if let Some(pending) = pending.take() {
                let personal = blend.personal.lasting(k);
                stage.expect(jump_m2, &pending, &personal);
                let own_m2 = stage.learn(&pending, contact_m, &personal);
                jump_m2 = own_m2.map_or(jump_m2, |own_m2| own_m2.max(jump_m2));
                let late_s = contact_s - pending.contact_s;
                stage.late.learn(late_s, pending.time_s2);
            }
            let ways = std::mem::replace(ways, Ways::NONE);
            if stage.is_settled() {
                let habits = &blend.personal.habits[k];
                stage.habit.learn(habits, &ways, contact_m);
            }
        }
        said.counts = [0.0; KNOTS];
        let each = said.misses.iter_mut().zip(&blend.typical_distances);
        for ((misses, typical), stage) in each.zip(&mut self.stages) {
            if let Some(distance) = misses.take(contact_m) {
                let own = self.spread * stage.spread;
                surprise += distance.min(SURPRISE * MOST_DISTANCE) / typical;
                let ratio = (distance / own).min(MOST_DISTANCE) / typical;
                counted += ratio;
                judged += 1.0;
                let gain = 1.0 / (PRIOR_STAGE + self.judged);
                let spread = stage.spread * (1.0 + gain * (ratio - 1.0));
                stage.spread = spread.clamp(STAGE_SPREADS[0], STAGE_SPREADS[1]);
            }
        }
        if judged > 0.0 {
            self.surprise += 0.5 * (surprise / judged - self.surprise);
            self.judged = FORGETTING * self.judged + 1.0;
            let gain = 1.0 / (PRIOR_SPREAD + self.judged);
            let spread = self.spread * (1.0 + gain * (counted / judged - 1.0));
            self.spread = spread.clamp(SPREADS[0], SPREADS[1]);
        }
        self.own_m[self.touches % OWN_ENDS] = contact_m;
        self.touches += 1;
    }
}

impl Stage {
    /// The errors may have jumped by a length with the square `jump_m2`, m²: the excess over the expected size becomes the variance of the
    /// persistent error.
    fn expect(&mut self, jump_m2: f64, pending: &Pending, personal: &[f64; SOURCES]) {
        let each = self.doubt.iter_mut().zip(&pending.squares_m2).zip(personal);
        // A source without an estimate cannot be updated.
        let heard = each.zip(&pending.ends_m).filter(|(_, end)| end.is_some());
        for (((doubt, square_m2), personal), _) in heard {
            let lasting = jump_m2 / square_m2.max(1e-9) - (1.0 - personal);
            *doubt = doubt.max(lasting.min(MOST_RATIO));
        }
    }

    /// True if no jump of the room is being followed. During one, misses say nothing about the person: a habit learned from them would persist
    /// after the sources have followed.
    fn is_settled(&self) -> bool {
        self.doubt.iter().filter(|doubt| **doubt > SETTLED).count() < AGREEING
    }

    /// Takes one touch; returns the squared length of a jump of the errors, m², if several sources agree on one.
    #[expect(clippy::needless_range_loop, reason = "several arrays by source")]
    fn learn(
        &mut self,
        pending: &Pending,
        contact_m: DVec3,
        personal: &[f64; SOURCES],
    ) -> Option<f64> {
        let (mut jumped, mut least_m2) = (0, f64::INFINITY);
        self.touches = FORGETTING * self.touches + 1.0;
        for k in 0..SOURCES {
            self.ratio[k] *= FORGETTING;
            let Some(end_m) = pending.ends_m[k] else {
                self.ratio[k] += 1.0;
                self.doubt[k] = self.doubt[k].min(SETTLED);
                continue;
            };
            let square_m2 = pending.squares_m2[k].max(1e-9);
            let by_chance = 1.0 - personal[k];
            let mut miss_m = end_m - self.bias_m[k] - contact_m;
            let ratio = miss_m.length_squared() / square_m2;
            let most = SURPRISE * (self.doubt[k] + by_chance);
            let odd_m = (ratio > most).then_some(miss_m);
            let before_m = std::mem::replace(&mut self.odd_m[k], odd_m);
            if odd_m.is_some() {
                let alike = |b: DVec3| b.distance(miss_m) < ALIKE * miss_m.length();
                if before_m.is_some_and(alike) {
                    // A persistent change is more likely than such a chance error.
                    self.doubt[k] = self.doubt[k].max(ratio - by_chance);
                    jumped += 1;
                    least_m2 = miss_m.length_squared().min(least_m2);
                } else {
                    miss_m *= (most / ratio).sqrt();
                }
            }
            let gain = (self.doubt[k] / (self.doubt[k] + by_chance)).min(MOST_GAIN);
            self.bias_m[k] += miss_m * gain;
            self.doubt[k] = self.doubt[k].min(MOST_RATIO) * (1.0 - gain) + DRIFT * personal[k];
            self.ratio[k] += ratio.min(MOST_RATIO);
        }
        if let Some(placed_m) = pending.placed_m {
            let way_m = placed_m - pending.combined_m;
            let typical_m2 = pending.way_m2.max(1e-9);
            let towards = (contact_m - pending.combined_m).dot(way_m) / typical_m2;
            self.towards = FORGETTING * self.towards + towards.clamp(-3.0, 3.0);
            self.way = FORGETTING * self.way + (way_m.length_squared() / typical_m2).min(3.0);
        }
        (jumped >= AGREEING).then_some(least_m2)
    }
}

impl Pending {
    /// Expected mean squares of the errors of the sources, m².
    pub(in crate::learned) fn squares_m2(region: &Region) -> [f64; SOURCES] {
        std::array::from_fn(|k| region.moments[k][k] * region.size_m2)
    }

    /// Mean with the earlier estimates; `latest` is the weight of this one.
    fn averaged(mut self, before: &Self, latest: f64) -> Self {
        let mean = |before: f64, now: f64| before + (now - before) * latest;
        for (k, end_m) in self.ends_m.iter_mut().enumerate() {
            *end_m = match (before.ends_m[k], *end_m) {
                (Some(before_m), Some(now_m)) => Some(before_m.lerp(now_m, latest)),
                (before_m, now_m) => now_m.or(before_m),
            };
            self.squares_m2[k] = mean(before.squares_m2[k], self.squares_m2[k]);
        }
        self.contact_s = mean(before.contact_s, self.contact_s);
        self.time_s2 = mean(before.time_s2, self.time_s2);
        self
    }
}

impl Blend {
    /// State before the first touch.
    pub(in crate::learned) fn fresh(&self) -> Adaptation {
        Adaptation::new(&self.personal)
    }
}
