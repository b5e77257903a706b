//! The places a person has touched.

use super::super::gaussian::Gaussian;
use super::super::hand::free_side::FreeSide;
use super::super::hand::resting::SurfacePlace;
use crate::matrices::isotropic;
use glam::DVec3;
use hwall_hand::HandState;

/// Scatter of touches of one place, standard deviation in each axis, m. The ends of the reaches of two recorded hands scatter by 36 and 42 mm over
/// all three axes; each axis gets that much, as a margin for hands that vary more.
pub(super) const SCATTER_M: f64 = 0.04;
/// A touch within this distance of a place belongs to it, m: two and a half standard deviations.
const SAME_M: f64 = 0.1;
/// Largest number of places kept.
const PLACES: usize = 8;
/// Weight of a touch relative to the next one.
pub(super) const FADES: f64 = 0.9;

/// A place and its touch count, discounted with age.
#[derive(Debug, Clone, Copy)]
pub(super) struct TouchedPlace {
    pub(super) point_m: DVec3,
    /// Its surface; `None` without a scene.
    pub(super) on: Option<SurfacePlace>,
    touches: f64,
}

impl TouchedPlace {
    /// Predictive distribution of its next touch.
    pub(super) fn gaussian(&self) -> Option<Gaussian> {
        // After one touch, the place itself is as uncertain as the next touch.
        let variances = 1.0 + 1.0 / self.touches.max(1.0);
        Gaussian::new(self.point_m, isotropic(SCATTER_M * variances.sqrt()))
    }
}

/// The places a person has touched before.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::predict) struct TouchedPlaces {
    places: [Option<TouchedPlace>; PLACES],
}

impl TouchedPlaces {
    pub(super) const fn forget(&mut self) {
        self.places = [None; PLACES];
    }

    pub(super) fn any(&self) -> bool {
        self.places.iter().any(Option::is_some)
    }

    /// Adds a touch.
    pub(super) fn touched(&mut self, point_m: DVec3, on: Option<SurfacePlace>) {
        let same = |p: &&mut TouchedPlace| {
            p.on.map(|on| on.surface) == on.map(|on| on.surface)
                && p.point_m.distance(point_m) <= SAME_M
        };
        for known in self.places.iter_mut().flatten() {
            known.touches *= FADES;
        }
        if let Some(same) = self.places.iter_mut().flatten().find(same) {
            same.touches += 1.0;
            same.point_m += (point_m - same.point_m) / same.touches;
            same.on = on;
            return;
        }
        let touches = |p: &Option<TouchedPlace>| p.map_or(0.0, |p| p.touches);
        let least = self
            .places
            .iter_mut()
            .min_by(|a, b| touches(a).total_cmp(&touches(b)));
        if let Some(least) = least {
            *least = Some(TouchedPlace {
                point_m,
                on,
                touches: 1.0,
            });
        }
    }

    /// The places and their shares, which sum to 1: by touch count and agreement with the motion.
    pub(super) fn shares(
        &self,
        motion: Option<&Gaussian>,
    ) -> impl Iterator<Item = (f64, &TouchedPlace)> {
        let log_weight = move |p: &TouchedPlace| {
            let off = motion.map_or(0.0, |motion| motion.mahalanobis_squared(p.point_m));
            p.touches.ln() - 0.5 * off
        };
        let all = || self.places.iter().flatten();
        let most = all().map(log_weight).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = all().map(|p| (log_weight(p) - most).exp()).sum();
        all().map(move |p| ((log_weight(p) - most).exp() / sum, p))
    }

    /// Log density of a touch at one of these places, per m³.
    pub(super) fn log_density(&self, point_m: DVec3, motion: Option<&Gaussian>) -> f64 {
        let density = |(share, place): (f64, &TouchedPlace)| {
            place
                .gaussian()
                .map_or(0.0, |g| share * g.log_density(point_m).exp())
        };
        self.shares(motion).map(density).sum::<f64>().ln()
    }
}

/// A touch ends once the hand is this far in front of the surface, m. If the hand is neither on nor behind a surface, the distance from the place
/// counts.
const AWAY_M: f64 = 0.08;
/// A hand that was lost for this long starts a new touch, s.
const LOST_S: f64 = 0.5;
/// A reported touch within this time of a detected one is the same touch, s.
const SAME_S: f64 = 1.0;

/// Detects the start of a touch: the hand passes through a surface or rests on one. The touch lasts until the hand has gone away.
#[derive(Debug, Clone, Copy)]
pub(super) struct TouchWatch {
    under_way: Option<SurfacePlace>,
    /// Start of the last touch, and time of the last sample, s.
    touched_s: f64,
    seen_s: f64,
}

impl Default for TouchWatch {
    fn default() -> Self {
        Self {
            under_way: None,
            touched_s: f64::NEG_INFINITY,
            seen_s: f64::NEG_INFINITY,
        }
    }
}

impl TouchWatch {
    /// Takes the hand; returns where a touch begins.
    pub(super) fn step(
        &mut self,
        hand: &HandState,
        side: &FreeSide,
        rests_on: Option<&SurfacePlace>,
    ) -> Option<SurfacePlace> {
        if hand.t_s < self.seen_s {
            // The clock was reset.
            self.touched_s = f64::NEG_INFINITY;
        }
        if !(0.0..=LOST_S).contains(&(hand.t_s - self.seen_s)) {
            self.under_way = None;
        }
        self.seen_s = hand.t_s;
        if let Some(place) = self.under_way {
            let way = hand.point_m - place.point_m;
            let is_free = side.behind.is_none() && rests_on.is_none();
            // A hand next to a table or behind the edge of a wall is not in front of the surface.
            if way.dot(place.normal) < AWAY_M && !(is_free && way.length() > AWAY_M) {
                return None;
            }
        }
        let through = side.behind.as_ref().map(SurfacePlace::of);
        let through = through.map(|place| place.facing(side.from_m));
        self.under_way = through.or(rests_on.copied());
        if self.under_way.is_some() {
            self.touched_s = hand.t_s;
        }
        self.under_way
    }

    /// Is a touch in progress?
    pub(super) const fn is_touching(&self) -> bool {
        self.under_way.is_some()
    }

    /// Takes a touch reported by the board; the board may be the only one to detect a quick tap. Returns whether it is new.
    pub(super) fn felt(&mut self, place: &SurfacePlace, t_s: f64) -> bool {
        let is_known = self.under_way.is_some() || (t_s - self.touched_s).abs() <= SAME_S;
        let is_news = !is_known && place.point_m.is_finite() && t_s.is_finite();
        if is_news {
            self.under_way = Some(*place);
            self.touched_s = t_s;
        }
        is_news
    }
}
