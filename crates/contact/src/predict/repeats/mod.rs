//! The places that this person has touched, one of which may come next.

use super::hand::free_side::FreeSide;
use super::hand::resting::SurfacePlace;
use super::prediction::ContactPrediction;
use super::regions::RegionSizes;
use crate::matrices::{Plane, axes_across};
use glam::{DMat3, DVec3};
use hwall_hand::HandState;
use hwall_scene::SurfaceId;

/// How far touches of one place lie apart, standard deviation in each axis, m. The ends of the reaches of the two recorded hands that the
/// main job is tried with scatter by 36 and 42 mm in all three axes together; each axis is given as much, for hands that vary more. A
/// place known from one touch is off twice.
const SCATTER_M: f64 = 0.04;
/// A touch this near to a place is one of that place, m: two and a half standard deviations.
const SAME_M: f64 = 0.1;
/// So many places are kept.
const PLACES: usize = 8;
/// Before the first touch nothing is known of a person: one of two would be of a place touched before ...
const REPEATS_BEFORE: f64 = 1.0;
const TOUCHES_BEFORE: f64 = 2.0;
/// ... and an older touch counts this much less than the next one.
const FADES: f64 = 0.9;
/// Touches of new places are spread over about a square metre, 1/m².
const NEW_PER_M2: f64 = 1.0;
/// Share of the predictions that are astray, and how many times their standard deviation they then are off.
const ASTRAY: [f64; 2] = [0.1, 3.0];
/// A touch is over once the hand is this far in front of the surface, or, on no surface and behind none, from the place, m.
const AWAY_M: f64 = 0.08;
/// A hand that was not seen for so long touches anew, s.
const LOST_S: f64 = 0.5;
/// What is felt within this time of a touch that was seen to begin is that touch, s.
const SAME_S: f64 = 1.0;
/// A place that is further than this from its surface has been left by it: a door has moved, m.
const LEFT_M: f64 = 0.03;
/// What was predicted so long before a touch shows how good predictions of this person are, s: the time that an arm needs.
const JUDGED_S: f64 = 0.3;
/// How many samples back a prediction is looked for, how far they are apart at least, s, and how near to that time one must be, s.
const SAMPLES: usize = 48;
const APART_S: f64 = 0.008;
const NEAR_S: f64 = 0.05;
/// Predictions as good as those learnt from count as so many touches; squared errors beyond this many times the usual as that many.
const GOOD_BEFORE: f64 = 2.0;
const MOST_SCALE: f64 = 10.0;
/// Before the first touch the odds that places touched before foretell the next one better than all people's habits do, as a logarithm ...
const CREDIT_BEFORE: f64 = 2.0;
/// ... which touches move this far at most.
const MOST_CREDIT: f64 = 3.0;
/// Density of touches where nothing is expected, 1/m².
const UNEXPECTED_PER_M2: f64 = 0.1;
/// Places less probable than this are not named.
const LEAST: f64 = 0.02;

/// A place, and how often it was touched, older touches counting less.
#[derive(Debug, Clone, Copy)]
struct TouchedPlace {
    place: SurfacePlace,
    touches: f64,
}

/// A prediction, until a touch tells whether it was right.
#[derive(Debug, Clone, Copy)]
struct Predicted {
    t_s: f64,
    surface: SurfaceId,
    point_m: DVec3,
    covariance_m2: DMat3,
    probability: f64,
    /// The place touched before that was the likeliest.
    repeat: Option<Repeat>,
}

/// A place touched before that may come next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Repeat {
    pub(super) place: SurfacePlace,
    /// Variance of the touch about it, in each direction along the surface, m².
    pub(super) along_m2: f64,
    pub(super) probability: f64,
}

/// The places that this person has touched, how often a touch is of one of them again, how good the predictions of this
/// person's touches have been, and how much better with those places.
///
/// It is asked of a person whose gaze is not seen: a look tells earlier and better what comes next.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    places: [Option<TouchedPlace>; PLACES],
    /// Sums over touches after the first, older ones counting less: those of a place touched before, and all.
    again: f64,
    all: f64,
    /// Sum of squared errors over the expected ones, and of how many touches.
    scale: f64,
    judged: f64,
    /// Logarithm of how many times as probable the touches were with the places touched before as without; older ones count less.
    credit: f64,
    /// The touch under way.
    under_way: Option<SurfacePlace>,
    /// When the last touch began, and when the hand was last seen, s.
    touched_s: f64,
    seen_s: f64,
    remembered_s: f64,
    said: [Option<Predicted>; SAMPLES],
    next: usize,
}

impl Default for Repeats {
    fn default() -> Self {
        Self {
            places: [None; PLACES],
            again: 0.0,
            all: 0.0,
            scale: 0.0,
            judged: 0.0,
            credit: 0.0,
            under_way: None,
            touched_s: f64::NEG_INFINITY,
            seen_s: f64::NEG_INFINITY,
            remembered_s: f64::NEG_INFINITY,
            said: [None; SAMPLES],
            next: 0,
        }
    }
}

impl Repeats {
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Takes the hand: a touch is where it goes through a surface or rests on one, until it has gone away from it.
    pub(super) fn step(
        &mut self,
        hand: &HandState,
        side: &FreeSide,
        rests_on: Option<&SurfacePlace>,
    ) {
        if hand.t_s < self.seen_s {
            // The clock was set back.
            self.said = [None; SAMPLES];
            [self.touched_s, self.remembered_s] = [f64::NEG_INFINITY; 2];
        }
        if !(0.0..=LOST_S).contains(&(hand.t_s - self.seen_s)) {
            self.under_way = None;
        }
        self.seen_s = hand.t_s;
        if let Some(place) = self.under_way {
            let way = hand.point_m - place.point_m;
            let is_free = side.behind.is_none() && rests_on.is_none();
            // Beside a table or round a wall the hand is not in front of it.
            if way.dot(place.normal) < AWAY_M && !(is_free && way.length() > AWAY_M) {
                return;
            }
            self.under_way = None;
        }
        let through = side.behind.as_ref().map(SurfacePlace::of);
        let through = through.map(|place| place.facing(side.from_m));
        if let Some(place) = through.or(rests_on.copied()) {
            self.under_way = Some(place);
            self.touched(&place, hand.t_s);
        }
    }

    /// Takes a touch that the board felt: of a quick tap nothing else may tell.
    pub(super) fn felt(&mut self, place: &SurfacePlace, t_s: f64) {
        let is_known = self.under_way.is_some() || (t_s - self.touched_s).abs() <= SAME_S;
        if !is_known && place.point_m.is_finite() && t_s.is_finite() {
            self.under_way = Some(*place);
            self.touched(place, t_s);
        }
    }

    fn touched(&mut self, place: &SurfacePlace, t_s: f64) {
        self.touched_s = t_s;
        self.judge(place, t_s);
        let known = self.places.iter().flatten().count() > 0;
        let same = |p: &&mut TouchedPlace| {
            p.place.surface == place.surface && p.place.point_m.distance(place.point_m) <= SAME_M
        };
        for known in self.places.iter_mut().flatten() {
            known.touches *= FADES;
        }
        let again = match self.places.iter_mut().flatten().find(same) {
            Some(same) => {
                same.touches += 1.0;
                let way = place.point_m - same.place.point_m;
                same.place.point_m += way / same.touches;
                same.place.normal = place.normal;
                true
            }
            None => {
                let touches = |p: &Option<TouchedPlace>| p.map_or(0.0, |p| p.touches);
                let least = self
                    .places
                    .iter_mut()
                    .min_by(|a, b| touches(a).total_cmp(&touches(b)));
                if let Some(least) = least {
                    *least = Some(TouchedPlace {
                        place: *place,
                        touches: 1.0,
                    });
                }
                false
            }
        };
        if known {
            self.again = FADES * self.again + f64::from(u8::from(again));
            self.all = FADES * self.all + 1.0;
        }
    }

    /// What was predicted before a touch, and what came.
    fn judge(&mut self, place: &SurfacePlace, t_s: f64) {
        let off_s = |said: &&Predicted| (t_s - said.t_s - JUDGED_S).abs();
        let said = self.said.iter().flatten();
        let said = said
            .min_by(|a, b| off_s(a).total_cmp(&off_s(b)))
            .filter(|said| off_s(said) <= NEAR_S);
        if let Some(said) = said {
            let axes = axes_across(place.normal);
            let there = said.surface == place.surface;
            let off = axes.map(|axis| (place.point_m - said.point_m).dot(axis));
            let covariance_m2 = Plane::of(&said.covariance_m2, axes);
            let ratio = if there {
                covariance_m2.squared(off) / 2.0
            } else {
                MOST_SCALE
            };
            let without = UNEXPECTED_PER_M2
                + f64::from(u8::from(there))
                    * said.probability
                    * mixed_per_m2(off, covariance_m2, 0.0, self.scale());
            let gain = said.repeat.map_or(0.0, |repeat| {
                let off = place.point_m - repeat.place.point_m;
                let off = axes.map(|axis| off.dot(axis));
                let own = Plane::ZERO.plus(repeat.along_m2);
                let there = f64::from(u8::from(repeat.place.surface == place.surface));
                let with = UNEXPECTED_PER_M2 + there * normal_per_m2(off, own);
                let odds = with / without;
                (repeat.probability * odds + 1.0 - repeat.probability).ln()
            });
            if ratio.is_finite() && gain.is_finite() {
                self.scale = FADES * self.scale + ratio.min(MOST_SCALE);
                self.judged = FADES * self.judged + 1.0;
                self.credit = (FADES * self.credit + gain).clamp(-MOST_CREDIT, MOST_CREDIT);
            }
        }
        self.said = [None; SAMPLES];
    }

    /// How many times as large the squared errors of predictions of this person are as predictions say themselves; at least 1.
    pub(super) fn scale(&self) -> f64 {
        ((GOOD_BEFORE + self.scale) / (GOOD_BEFORE + self.judged)).max(1.0)
    }

    /// Remembers the prediction of a sample.
    fn remember(&mut self, t_s: f64, first: &ContactPrediction, repeat: Option<Repeat>) {
        if t_s - self.remembered_s < APART_S {
            return;
        }
        self.remembered_s = t_s;
        self.said[self.next] = first.covariance_m2.map(|covariance_m2| Predicted {
            t_s,
            surface: first.surface,
            point_m: first.point_m,
            covariance_m2,
            probability: first.probability,
            repeat,
        });
        self.next = (self.next + 1) % SAMPLES;
    }

    /// The place touched before that most probably comes next, for a hand that has gone away from what it touched last; `ranked` is what
    /// is predicted otherwise. Doors move: `off_m` says how far a point is from its surface.
    pub(super) fn likeliest(
        &mut self,
        t_s: f64,
        ranked: &[ContactPrediction],
        off_m: impl Fn(&SurfacePlace) -> Option<f64>,
    ) -> Option<Repeat> {
        let first = ranked.first()?;
        let is_there = |p: &TouchedPlace| off_m(&p.place).is_some_and(|off_m| off_m <= LEFT_M);
        let places = self.places.map(|p| p.filter(is_there));
        let repeat = self.likeliest_if_any_is(&places, ranked);
        self.remember(t_s, first, repeat);
        let mut repeat = repeat.filter(|_| self.under_way.is_none())?;
        // Who touches always other places is expected anywhere.
        repeat.probability /= 1.0 + (-CREDIT_BEFORE - self.credit).exp();
        // NaN is not probable.
        (repeat.probability >= LEAST).then_some(repeat)
    }

    /// The likeliest of the places, if they do foretell the next touch.
    fn likeliest_if_any_is(
        &self,
        places: &[Option<TouchedPlace>; PLACES],
        ranked: &[ContactPrediction],
    ) -> Option<Repeat> {
        let scale = self.scale();
        let again = (REPEATS_BEFORE + self.again) / (TOUCHES_BEFORE + self.all);
        let each = || places.iter().flatten();
        let all: f64 = each().map(|p| p.touches).sum();
        let odds = |touched: &TouchedPlace| {
            let per_m2 = density_per_m2(ranked, &touched.place, scale);
            again * touched.touches / all * per_m2 / NEW_PER_M2
        };
        let sum = each().map(odds).sum::<f64>() + 1.0 - again;
        let touched = each().max_by(|a, b| odds(a).total_cmp(&odds(b)))?;
        let probability = odds(touched) / sum;
        let SurfacePlace {
            surface,
            point_m,
            normal,
        } = touched.place;
        let mut repeat = Repeat {
            place: touched.place,
            along_m2: SCATTER_M * SCATTER_M * (1.0 + 1.0 / touched.touches.max(1.0)),
            probability,
        };
        let of_surface = ranked.iter().find(|p| p.surface == surface);
        if let Some(predicted) = of_surface
            && let Some(covariance_m2) = typical_m2(predicted)
        {
            let Plane { uu, vv, .. } = Plane::of(&covariance_m2, axes_across(normal));
            let share = repeat.along_m2 / (repeat.along_m2 + scale * (uu + vv) / 2.0);
            let way = predicted.point_m - point_m;
            let way = way - normal * way.dot(normal);
            // One that is further away means another place.
            if share.is_finite() && way.length() <= SAME_M {
                repeat.place.point_m += way * share;
                repeat.along_m2 *= 1.0 - share;
            }
        }
        probability.is_finite().then_some(repeat)
    }
}

/// The density that ranked contacts give to a place touched before, 1/m², if their squared errors are `scale` times as large as
/// they say.
fn density_per_m2(ranked: &[ContactPrediction], place: &SurfacePlace, scale: f64) -> f64 {
    let axes = axes_across(place.normal);
    let of_surface = ranked.iter().find(|p| p.surface == place.surface);
    let predicted = of_surface.and_then(|p| Some((p, typical_m2(p)?)));
    let Some((predicted, covariance_m2)) = predicted else {
        return 0.0;
    };
    let off = place.point_m - predicted.point_m;
    let off = axes.map(|axis| off.dot(axis));
    let mixed = mixed_per_m2(
        off,
        Plane::of(&covariance_m2, axes),
        SCATTER_M * SCATTER_M,
        scale,
    );
    let mixed = mixed * predicted.probability;
    if mixed.is_finite() { mixed } else { 0.0 }
}

/// Density of a touch so far off, 1/m², where some predictions are astray; `own_m2` is added to the covariance in each direction.
fn mixed_per_m2(off: [f64; 2], covariance_m2: Plane, own_m2: f64, scale: f64) -> f64 {
    let [share, stretch] = ASTRAY;
    let density = |factor: f64| normal_per_m2(off, covariance_m2.map(|c| c * factor).plus(own_m2));
    (1.0 - share) * density(scale) + share * density(scale * stretch * stretch)
}

/// The density of a normal distribution in two dimensions, 1/m².
fn normal_per_m2(off: [f64; 2], covariance_m2: Plane) -> f64 {
    let peak_m2 = std::f64::consts::TAU * covariance_m2.determinant().sqrt();
    (-0.5 * covariance_m2.squared(off)).exp() / peak_m2
}

/// The covariance whose region of 50 % is the one that was learnt: where most errors are much smaller than is stated, a few are larger,
/// and those are what `ASTRAY` is for.
fn typical_m2(predicted: &ContactPrediction) -> Option<DMat3> {
    let [learnt, normal] = [predicted.regions, RegionSizes::NORMAL].map(|r| r.squared()[0]);
    Some(predicted.covariance_m2? * (learnt / normal))
}

#[cfg(test)]
mod tests;
