//! Prediction from all evidence: the hand's motion, the gaze, the surfaces and the time.

mod ranking;

use super::deterministic::DeterministicPredictor;
use super::fused_config::FusedConfig;
use super::gaussian::Gaussian;
use super::gaze::idle::IdlePlaces;
use super::gaze::memory::GazeMemory;
use super::gaze::weights::{ASTRAY_SHARE, ASTRAY_STRETCH, ByHand, Hypothesis};
use super::hand::free_side::{FreeSide, SideWatch};
use super::hand::place::{HandPlace, by_motion_alone, close, gaussian_of, near};
use super::hand::resting::{RestWatch, SurfacePlace, facing};
use super::hand::straight_way::StraightWay;
use super::prediction::{ContactPrediction, Predictor, PredictorInput};
use super::repeats::Repeats;
use super::stream::StreamEstimator;
use super::surface_shares::{SeenFace, SurfaceShares, Viewpoint};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use crate::matrices::{isotropic, trace};
use crate::registration::{MeasuredTouch, RegistrationEstimator};
use glam::{DMat3, DVec3};
use hwall_hand::{GazeRay, HandState, Pose};
use hwall_scene::{Hit, Scene, SurfaceId};

/// Fuses an estimate of where the hand's motion ends with the gaze and the surfaces of the scene.
///
/// For every sample:
/// 1. The estimator gives N(m, C) for the contact point. It is narrowed across the direction of motion
///    in proportion to the way left to the next surface. Beside it stands where people touch whose hand rests where this one
///    rests, or rested before it moved: a hand at rest says little, and the first moments of a reach may be no reach, or one for
///    another place than the one that was meant.
/// 2. The gaze makes each of the two a mixture of three hypotheses: the Gaussian times a Gaussian about the present line of
///    sight, the same about the look before, and the Gaussian alone, for a person who does not look at
///    the target. An estimate that was learnt is drawn towards where people usually touch, which is nearly all that it says
///    when a reach begins; that is taken out of it where a line of sight says which place is meant. Each is weighed by how
///    probable it makes both lines of sight, and by how often it is the true one in this phase of a reach at this age of the
///    look, and at a place where this person's eyes rest in pauses or not, which is learnt ([`GazeModel`](super::GazeModel)). Some
///    estimates are assumed to be further off than they state, so that a look far away from one still counts.
/// 3. Each hypothesis is divided among the surfaces: density in the plane of a face, times the share of it
///    that straight ways from the hand meet first, times the sine of the angle at which they meet it; for hypotheses that owe
///    nothing to the motion, ways from the eyes. Surfaces that cannot be touched block the way.
/// 4. For each surface the parts add up to a probability and a covariance; the point is the mean of those
///    that agree with the most probable one.
///
/// Estimates of successive samples share their history, and a fixation has one error, not one per sample.
/// So nothing is multiplied over time: a prediction follows from the estimate and the two looks at that
/// time. A change of mind is followed as fast as the estimator and the eyes follow it. While the gaze is in flight, or lost for
/// less than 0.3 s, the last look counts on.
///
/// The error of registration of the tracker to the scene widens every part of the mixture and every covariance
/// across its surface, so covariances are positive definite. The covariance of a surface mixes all parts that
/// end there: of a place that is looked at it has the error of the gaze in each direction of the surface, which along a
/// surface seen at a slant is many times that across. With [`FusedConfig::registration`] it is learnt from touches
/// ([`Predictor::touched`]): what the tracker sees is corrected by what they told, and only the error that is left widens.
///
/// A hand at rest on a surface touches it: that surface comes first, with the error of registration as its
/// covariance and time 0, and a tenth of the probability goes to all other surfaces, until the hand is faster than the
/// onset of a reach or further away than a few errors of registration.
///
/// While no gaze is seen, the places that this person has touched before count, too. Touches are those that are
/// [felt](Predictor::touched), those of a hand that rests on a surface, and those of one that goes through a surface that nothing
/// stands for. They say how often this person comes back, how good predictions of this person have been, and whether they were better with
/// those places than without; covariances grow for a person of whom predictions were worse than they said. The place
/// that probably comes next is named beside the others ([`PredictionSource::TouchedBefore`](super::PredictionSource::TouchedBefore)).
///
/// The estimator's normal is not used: faces have exact ones, and the point and the direction of motion already
/// tell which is meant.
///
/// A hand that has gone through a surface touches that surface, from the side it came from. When no surface
/// lies where the evidence points, a [`DeterministicPredictor`] takes over; it also leads where the estimator was learnt from too
/// little ([`FusedPredictor::experience`]). Nothing is allocated after the first samples, except by the estimator.
#[derive(Debug, Clone)]
pub struct FusedPredictor<E> {
    stream: StreamEstimator<E>,
    config: FusedConfig,
    gaze: GazeMemory,
    idle: IdlePlaces,
    shares: SurfaceShares,
    side: SideWatch,
    rest: RestWatch,
    repeats: Repeats,
    estimate: Option<ContactEstimate>,
    look: Option<TargetLook>,
    fallback: DeterministicPredictor,
    registration: Option<RegistrationEstimator>,
    /// Error of registration at the hand: what is left of it, m².
    registration_m2: DMat3,
    /// A touch that the registration has yet to learn from: where it was seen, m, and of which surface.
    touched: Option<(DVec3, SurfaceId)>,
    /// Of the last sample, the most probable first.
    ranked: Vec<ContactPrediction>,
}

impl<E: ContactEstimator> FusedPredictor<E> {
    /// A predictor that has seen nothing.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(estimator: E, config: FusedConfig) -> Result<Self, ContactError> {
        config.validate()?;
        Ok(Self {
            stream: StreamEstimator::new(estimator, config.watch)?,
            shares: SurfaceShares::new(config.rays),
            fallback: DeterministicPredictor::new(config.fallback)?,
            registration: config
                .registration
                .map(RegistrationEstimator::new)
                .transpose()?,
            registration_m2: isotropic(config.registration_sd_m),
            touched: None,
            config,
            gaze: GazeMemory::default(),
            idle: IdlePlaces::default(),
            side: SideWatch::default(),
            rest: RestWatch::default(),
            repeats: Repeats::default(),
            estimate: None,
            look: None,
            ranked: Vec::with_capacity(16),
        })
    }

    /// The estimate of the last sample, before gaze and scene; `None` at rest.
    #[must_use]
    pub const fn estimate(&self) -> Option<&ContactEstimate> {
        self.estimate.as_ref()
    }

    /// The estimator.
    #[must_use]
    pub const fn estimator(&self) -> &E {
        self.stream.estimator()
    }

    /// Is the estimator believed?
    #[must_use]
    pub fn experience(&self) -> Experience {
        let needed = self.config.least_reaches;
        match self.stream.estimator().training_reaches() {
            Some(reaches) if reaches < needed => Experience::TooLittle { reaches, needed },
            _ => Experience::Enough,
        }
    }

    /// The present look, and how probably it is at the place of the next contact; `None` without one, for a lost hand, and
    /// while the ray leads.
    #[must_use]
    pub const fn look(&self) -> Option<&TargetLook> {
        self.look.as_ref()
    }

    /// What touches told of the registration; `None` without [`FusedConfig::registration`].
    #[must_use]
    pub const fn registration(&self) -> Option<&RegistrationEstimator> {
        self.registration.as_ref()
    }

    /// Learns from the touch of the last sample. The hand is on the surface that it was predicted to touch, so that is where it is.
    fn learn_registration(&mut self, scene: &Scene) {
        let Some((seen_m, surface)) = self.touched.take() else {
            return;
        };
        let Some(registration) = &mut self.registration else {
            return;
        };
        let at_m = registration.true_from_seen().transform_point(seen_m);
        let Some(closest) = scene.project_on(surface, at_m).ok() else {
            return;
        };
        if closest.distance_m <= TOUCHED_M {
            let touch = MeasuredTouch {
                seen_m,
                surface_m: closest.point_m,
                normal: closest.normal,
                located_sd_m: None,
            };
            // Only what is no touch is refused, and teaches nothing.
            let _ = registration.touched(&touch);
        }
    }

    /// What corrects the tracker; `None` while there is nothing to correct. Sets the error that is left at the hand.
    fn correction(&mut self, hand: Option<&HandState>) -> Option<Pose> {
        let registration = self.registration.as_ref()?;
        if let Some(hand) = hand.filter(|hand| hand.point_m.is_finite()) {
            self.registration_m2 = registration.covariance_m2(hand.point_m);
        }
        (registration.touches() > 0).then(|| registration.true_from_seen())
    }

    /// Standard deviation of the error of registration across a surface, m.
    fn registration_across_m(&self, normal: DVec3) -> f64 {
        match self.registration {
            Some(_) => normal.dot(self.registration_m2 * normal).max(0.0).sqrt(),
            None => self.config.registration_sd_m,
        }
    }

    /// Root of its mean variance in the three axes, m.
    fn registration_sd_m(&self) -> f64 {
        match self.registration {
            Some(_) => (trace(&self.registration_m2) / 3.0).sqrt(),
            None => self.config.registration_sd_m,
        }
    }

    /// What the hand alone says: where its motion leads, and where a hand at rest here may touch.
    fn by_hand(&self, scene: &Scene, hand: &HandState) -> Option<ByHand> {
        let default_sd_m = self.config.default_sd_m;
        let estimate = self.estimate.as_ref();
        let estimated = estimate.and_then(|e| gaussian_of(e, default_sd_m));
        let began = self.stream.began();
        let place = HandPlace::new(
            hand,
            began,
            self.stream.stirred_m(),
            estimate,
            &self.config.watch,
        );
        // The first surface on the way, once for all that ends there.
        let directed = place.moves || place.is_fast;
        let ahead = hand.direction.filter(|_| directed).and_then(|ahead| {
            let hit = scene.ray_cast(hand.point_m, ahead).ok()??;
            Some((ahead, hit.distance_m))
        });
        let straight = |g: &Gaussian| {
            let bend = self.config.bend?;
            Some(StraightWay::new(
                hand.point_m,
                ahead?,
                bend,
                g,
                self.registration_m2,
            ))
        };
        let straight_on = |g: &Gaussian| straight(g)?.narrowed();
        let narrowed = |g: Gaussian| straight_on(&g).unwrap_or(g);
        // A regression is drawn towards where people usually touch. For a place that is looked at, scene and gaze say
        // which places there are; to count that, too, would drag a look at an unusual place towards the usual ones.
        let by_motion = estimate
            .and_then(|e| by_motion_alone(e, began, default_sd_m))
            .map(narrowed);
        let anew = if place.moves {
            straight_on(&near(hand.point_m)?).or_else(|| close(hand.point_m))
        } else {
            self.config.gaze.rest.about(place.rest_m)
        };
        Some(ByHand {
            phase: place.phase,
            began_s: began.map(|began| began.since_s),
            as_moves: estimated.map(narrowed),
            straight: estimated.as_ref().and_then(straight),
            by_motion,
            anew: anew?,
        })
    }

    /// Finds the faces of every hypothesis. Returns whether any is met.
    fn divide(&mut self, scene: &Scene, hand: &HandState, side: &FreeSide) -> bool {
        self.shares.clear();
        let Some(by_hand) = self.by_hand(scene, hand) else {
            return false;
        };
        let gaze = &self.config.gaze;
        // What the two lines of sight meet, once for all hypotheses.
        let (now, before) = self.gaze.looks(hand.t_s, gaze.memory_s);
        let sights = [now, before.map(|(look, _)| look)].map(|look| {
            let ray = look?.ray;
            let hit = scene.ray_cast(ray.origin_m, ray.direction).ok()??;
            Some((ray, hit))
        });
        let met_by = |ray: &GazeRay| {
            let mut met = sights.iter().flatten();
            met.find(|(sight, _)| sight == ray).map(|(_, hit)| *hit)
        };
        let distance_m = |ray: &GazeRay| Some(met_by(ray)?.distance_m);
        let hypotheses = gaze.weigh(&by_hand, (&self.gaze, &self.idle), hand.t_s, distance_m);
        for hypothesis in hypotheses.into_iter().flatten() {
            let from = self.viewpoint(hand, side, &hypothesis);
            // What the line of sight meets may be meant although the straight way there is blocked.
            let seen = hypothesis.sight.and_then(|ray| {
                let hit = met_by(&ray)?;
                let near = hit.point_m.distance(hand.point_m) <= self.config.max_distance_m;
                (near && scene.surface(hit.surface).touchable()).then(|| SeenFace {
                    hit: Hit {
                        normal: facing(hit.normal, side.from_m - hit.point_m),
                        ..hit
                    },
                    share: ROUND_ABOUT_SHARE,
                })
            });
            let widened = hypothesis.gaussian.widened(self.registration_m2);
            let Some(gaussian) = widened else { continue };
            let registered = Hypothesis {
                gaussian,
                ..hypothesis
            };
            let unseen = hypothesis.as_moves && hypothesis.sight.is_none();
            let straight = by_hand.straight.filter(|_| unseen);
            let straight = straight.map(|straight| straight.from(from.origin_m));
            let met = self
                .shares
                .add(scene, &from, &registered, seen, straight.as_ref());
            if !met && hypothesis.as_moves && hypothesis.sight.is_none() {
                self.add_closest(scene, side, &gaussian, hypothesis.weight);
            }
        }
        if self.shares.compare() {
            return true;
        }
        if let Some(gaussian) = by_hand.as_moves {
            self.add_closest(scene, side, &gaussian, 1.0);
        }
        self.shares.compare()
    }

    /// An estimate that lies beyond the edges of all surfaces is astray, and means the closest.
    fn add_closest(&mut self, scene: &Scene, side: &FreeSide, estimate: &Gaussian, weight: f64) {
        let radius_m = 4.0 * estimate.sd_m();
        let Some(astray) = estimate.stretched(ASTRAY_STRETCH) else {
            return;
        };
        let weight = weight * ASTRAY_SHARE;
        self.shares
            .add_closest(scene, side.from_m, (&astray, weight), radius_m);
    }

    /// Where the surfaces of a hypothesis are looked for from: a hand that moves meets what lies on its way, one that has not
    /// chosen its way yet may go to whatever the person sees.
    fn viewpoint(&self, hand: &HandState, side: &FreeSide, hypothesis: &Hypothesis) -> Viewpoint {
        let (origin_m, heading) = match self.gaze.now() {
            Some(look) if !hypothesis.as_moves => (look.ray.origin_m, Some(look.ray.direction)),
            _ => {
                let slow_m_per_s = self.config.watch.offset_m_per_s;
                let moves = hypothesis.as_moves || hand.velocity_m_per_s.length() > slow_m_per_s;
                (side.from_m, hand.direction.filter(|_| moves))
            }
        };
        Viewpoint {
            origin_m,
            heading,
            max_distance_m: self.config.max_distance_m + origin_m.distance(hand.point_m),
        }
    }
}

/// What an estimator's word is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experience {
    /// It is believed.
    Enough,
    /// It was learnt from too little, and the ray leads.
    TooLittle {
        /// The reaches it was learnt from.
        reaches: usize,
        /// How many there must be ([`FusedConfig::least_reaches`]).
        needed: usize,
    },
}

/// A look, and what it means for the next contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetLook {
    /// When the eyes came to rest on the place, s.
    pub since_s: f64,
    /// How long they have rested on it, looks at it just before included, s.
    pub age_s: f64,
    /// Probability that the place of the next contact is the one looked at.
    pub probability: f64,
}

/// Share of the places looked at that can be reached although the straight way from the hand is blocked.
const ROUND_ABOUT_SHARE: f64 = 0.1;

/// A touch is told to the registration if the hand was seen this near to the surface, m.
const TOUCHED_M: f64 = 0.08;

impl<E: ContactEstimator> Predictor for FusedPredictor<E> {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.learn_registration(scene);
        let (frame, hand);
        let corrected;
        let input = match self.correction(input.hand) {
            None => input,
            Some(true_from_seen) => {
                frame = input.frame.transformed(&true_from_seen);
                hand = input.hand.map(|hand| hand.transformed(&true_from_seen));
                corrected = PredictorInput {
                    frame: &frame,
                    hand: hand.as_ref(),
                    gaze: input.gaze.transformed(&true_from_seen),
                };
                &corrected
            }
        };
        self.ranked.clear();
        self.look = None;
        let finite = |e: &ContactEstimate| e.point_m.is_finite();
        self.estimate = self.stream.step(input.frame, input.hand).filter(finite);
        let apart_rad = self.config.gaze.apart_rad();
        self.gaze.step(input.frame.t_s, &input.gaze, apart_rad);
        let (reaching, hand_m) = (self.stream.reaching(), input.hand.map(|hand| hand.point_m));
        self.idle.step(&self.gaze, reaching, hand_m, apart_rad);
        // It follows every sample, so that it can take over at any.
        let followed = self.fallback.follow(scene, input);
        let usable = |h: &&HandState| h.point_m.is_finite() && h.velocity_m_per_s.is_finite();
        let Some(hand) = input.hand.filter(usable) else {
            self.rest.forget();
            return &self.ranked;
        };
        if self.experience() == Experience::Enough {
            let eye_m = self.gaze.now().map(|look| look.ray.origin_m);
            let side = self.side.free_side(scene, hand, eye_m);
            let registration_sd_m = self.registration_sd_m();
            let watch = &self.config.watch;
            let touched = self.rest.rest(scene, hand, &side, registration_sd_m, watch);
            let met = self.divide(scene, hand, &side);
            if met || touched.is_some() {
                self.rank(scene, hand, side.behind.is_some(), touched);
            }
            self.repeats.step(hand, &side, touched.as_ref());
            self.add_repeat(scene, hand);
        }
        if self.ranked.is_empty() {
            let by_ray = followed.and_then(|f| self.fallback.contact(scene, hand, f));
            self.ranked.extend(by_ray);
        }
        &self.ranked
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let corrected_m = match &self.registration {
            Some(registration) if registration.touches() > 0 => {
                registration.true_from_seen().transform_point(contact_m)
            }
            _ => contact_m,
        };
        self.stream.touched(corrected_m, contact_s);
        if let Some(first) = self.ranked.first() {
            let place = SurfacePlace {
                surface: first.surface,
                point_m: corrected_m,
                normal: first.normal,
            };
            self.repeats.felt(&place, contact_s);
        }
        let first = self.ranked.first().map(|first| (contact_m, first.surface));
        self.touched = first.filter(|_| self.registration.is_some());
    }

    fn reset(&mut self) {
        self.stream.reset();
        self.gaze.forget();
        self.idle.forget();
        self.side.forget();
        self.rest.forget();
        self.repeats.forget();
        self.fallback.reset();
        if let Some(registration) = &mut self.registration {
            registration.forget();
        }
        self.touched = None;
        self.estimate = None;
        self.look = None;
        self.ranked.clear();
    }
}
