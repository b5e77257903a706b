//! What the touches of one person in one room teach beyond what was learnt from others.

use crate::learned::blend::combination::{Blend, KNOTS, Region};
use crate::learned::blend::places::OWN_ENDS;
use crate::learned::blend::sources::{Ends, SOURCES};
use glam::{DMat3, DVec3};

/// An older touch counts this much less than the next one.
const FORGETTING: f64 = 0.92;
/// What was learnt from others counts as so many touches, for the sizes of the sources' errors, for the spread and for
/// the places.
const PRIOR_RATIO: f64 = 4.0;
const PRIOR_SPREAD: f64 = 6.0;
const PRIOR_SHARE: f64 = 4.0;
/// Squared errors beyond this many times the usual count as that many.
const MOST_RATIO: f64 = 60.0;
/// Largest squared distance per axis that counts for the spread, in standard deviations.
const MOST_DISTANCE: f64 = 12.0;
/// An error this many times larger than was expected, squared, is a surprise: the room may have moved.
const SURPRISE: f64 = 9.0;
/// Largest share of one error that is taken for lasting.
const MOST_GAIN: f64 = 0.7;
/// Share of a lasting error's variance that is added with every touch: habits and rooms drift.
const DRIFT: f64 = 0.02;
/// Bounds of the factor on the covariance.
const SPREADS: [f64; 2] = [0.4, 12.0];

/// What one estimate said, until the contact tells whether it was right.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Pending {
    /// By each source, before any correction, m.
    pub(in crate::learned) ends_m: Ends,
    /// Mean square of the error of each source that was expected, m².
    pub(in crate::learned) squares_m2: [f64; SOURCES],
    /// The combination, the places near it, and what was said, m.
    pub(in crate::learned) combined_m: DVec3,
    pub(in crate::learned) placed_m: Option<DVec3>,
    pub(in crate::learned) said_m: DVec3,
    /// Usual square of the way to the places, m².
    pub(in crate::learned) way_m2: f64,
    /// Covariance of the error by what was learnt from others, m².
    pub(in crate::learned) covariance_m2: DMat3,
}

/// What is learnt at one value of the time left.
#[derive(Debug, Clone, Copy)]
struct Stage {
    /// Lasting error of each source, m, and its variance as a share of the source's mean square.
    bias_m: [DVec3; SOURCES],
    doubt: [f64; SOURCES],
    /// Sums over touches, older ones counting less: squared errors over the expected ones, and how many.
    ratio: [f64; SOURCES],
    distance: f64,
    touches: f64,
    /// Sums for the way to the places.
    towards: f64,
    way: f64,
}

/// Touches of one person in one room.
#[derive(Debug, Clone)]
pub(in crate::learned) struct Adaptation {
    stages: [Stage; KNOTS],
    pending: [Option<Pending>; KNOTS],
    /// The last touches, m, in a ring.
    own_m: [DVec3; OWN_ENDS],
    touches: usize,
    /// How much larger the squared errors of late were than expected.
    surprise: f64,
}

/// What adaptation says at one time left.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Adapted {
    pub(in crate::learned) bias_m: [DVec3; SOURCES],
    pub(in crate::learned) ratios: [f64; SOURCES],
    pub(in crate::learned) spread: f64,
}

impl Adaptation {
    pub(in crate::learned) fn new(personal: &[f64; SOURCES]) -> Self {
        let stage = Stage {
            bias_m: [DVec3::ZERO; SOURCES],
            doubt: *personal,
            ratio: [0.0; SOURCES],
            distance: 0.0,
            touches: 0.0,
            towards: 0.0,
            way: 0.0,
        };
        Self {
            stages: [stage; KNOTS],
            pending: [None; KNOTS],
            own_m: [DVec3::ZERO; OWN_ENDS],
            touches: 0,
            surprise: 1.0,
        }
    }

    pub(in crate::learned) fn begin(&mut self) {
        self.pending = [None; KNOTS];
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

    /// Between stages, by the weights of the knots.
    pub(in crate::learned) fn at(&self, hats: &[f64; KNOTS], usual_distance: f64) -> Adapted {
        let mut out = Adapted {
            bias_m: [DVec3::ZERO; SOURCES],
            ratios: [0.0; SOURCES],
            spread: 0.0,
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
            let far = PRIOR_SPREAD * usual_distance + stage.distance;
            let spread = far / ((PRIOR_SPREAD + stage.touches) * usual_distance);
            out.spread += hat * spread.clamp(SPREADS[0], SPREADS[1]);
        }
        out
    }

    /// Share of the way to the places: what was learnt from others, and from touches since.
    pub(in crate::learned) fn share(&self, hats: &[f64; KNOTS], learnt: f64) -> f64 {
        let shares = self.stages.iter().map(|stage| {
            let share = (PRIOR_SHARE * learnt + stage.towards) / (PRIOR_SHARE + stage.way);
            share.clamp(0.0, 1.0)
        });
        shares.zip(hats).map(|(s, h)| s * h).sum()
    }

    /// Remembers what an estimate said; of several at about the same time left the last counts.
    pub(in crate::learned) fn remember(&mut self, hats: &[f64; KNOTS], pending: Pending) {
        let mut nearest = 0;
        for k in 1..KNOTS {
            if hats[k] > hats[nearest] {
                nearest = k;
            }
        }
        self.pending[nearest] = Some(pending);
    }

    /// The reach has ended with a touch, m.
    pub(in crate::learned) fn touched(&mut self, contact_m: DVec3, personal: &[f64; SOURCES]) {
        let (mut surprise, mut judged) = (0.0, 0.0);
        for (stage, pending) in self.stages.iter_mut().zip(&mut self.pending) {
            if let Some(pending) = pending.take() {
                surprise += stage.learn(&pending, contact_m, personal);
                judged += 1.0;
            }
        }
        if judged > 0.0 {
            self.surprise += 0.5 * (surprise / judged - self.surprise);
        }
        self.own_m[self.touches % OWN_ENDS] = contact_m;
        self.touches += 1;
    }
}

impl Stage {
    /// Takes one touch; returns how much larger the squared error was than expected.
    #[expect(clippy::needless_range_loop, reason = "several arrays by source")]
    fn learn(&mut self, pending: &Pending, contact_m: DVec3, personal: &[f64; SOURCES]) -> f64 {
        self.touches = FORGETTING * self.touches + 1.0;
        for k in 0..SOURCES {
            self.ratio[k] *= FORGETTING;
            let Some(end_m) = pending.ends_m[k] else {
                self.ratio[k] += 1.0;
                continue;
            };
            let square_m2 = pending.squares_m2[k].max(1e-9);
            let by_chance = 1.0 - personal[k];
            let miss_m = end_m - self.bias_m[k] - contact_m;
            let ratio = miss_m.length_squared() / square_m2;
            if ratio > SURPRISE * (self.doubt[k] + by_chance) {
                // A lasting change is likelier than such a chance.
                self.doubt[k] = self.doubt[k].max(ratio - by_chance);
            }
            let gain = (self.doubt[k] / (self.doubt[k] + by_chance)).min(MOST_GAIN);
            self.bias_m[k] += miss_m * gain;
            self.doubt[k] = self.doubt[k].min(MOST_RATIO) * (1.0 - gain) + DRIFT * personal[k];
            self.ratio[k] += ratio.min(MOST_RATIO);
        }
        let far_m = pending.said_m - contact_m;
        let distance = far_m.dot(pending.covariance_m2.inverse() * far_m) / 3.0;
        self.distance = FORGETTING * self.distance + distance.min(MOST_DISTANCE);
        if let Some(placed_m) = pending.placed_m {
            let way_m = placed_m - pending.combined_m;
            let usual_m2 = pending.way_m2.max(1e-9);
            let towards = (contact_m - pending.combined_m).dot(way_m) / usual_m2;
            self.towards = FORGETTING * self.towards + towards.clamp(-3.0, 3.0);
            self.way = FORGETTING * self.way + (way_m.length_squared() / usual_m2).min(3.0);
        }
        distance
    }
}

impl Pending {
    /// What is expected of the errors of the sources, m².
    pub(in crate::learned) fn squares_m2(region: &Region) -> [f64; SOURCES] {
        std::array::from_fn(|k| region.moments[k][k] * region.size_m2)
    }
}

impl Blend {
    /// Nobody has touched anything yet.
    pub(in crate::learned) fn fresh(&self) -> Adaptation {
        Adaptation::new(&self.personal)
    }
}
