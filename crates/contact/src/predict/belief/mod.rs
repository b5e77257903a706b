//! Prediction from all evidence: hand motion, gaze, earlier touches and the surfaces.

mod context;
mod gaze_error;
mod model;
mod person;
mod places;
mod ranking;
mod sample;
mod training;

use super::deterministic::DeterministicPredictor;
use super::fused_config::FusedConfig;
use super::gaze_memory::GazeMemory;
use super::hand::free_side::{FreeSide, SideWatch};
use super::hand::resting::{RestWatch, SurfacePlace, facing};
use super::prediction::{ContactPrediction, Predictor, PredictorInput};
use super::stream::StreamEstimator;
use super::surface_shares::{SeenFace, SurfaceShares, Viewpoint};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use crate::matrices::isotropic;
use glam::DVec3;
use hwall_hand::{GazeRay, HandState};
use hwall_scene::{Hit, Scene, SurfaceId};
use person::Person;
use places::{TouchWatch, TouchedPlaces};
use sample::Sample;

pub use context::{EvidenceSource, SourceShares};
pub use model::{EvidenceModel, RestingHand};
pub use training::{LabelledStream, StreamContact, StreamFilters};

/// Predicts the next contact by a mixture over the sources of evidence.
///
/// For every sample:
/// 1. Each [`EvidenceSource`] gives a normal distribution of the contact: the end of the motion by the estimator, a point on the line of sight of
///    the present fixation and of the one before it, the places this person has touched, and everywhere else.
/// 2. The distributions are weighted by how often each source is right in this phase of a reach, at this age of the fixation, and for this
///    agreement of fixation and motion ([`EvidenceModel`], learned from recordings). Each touch updates the shares of the sources and the
///    error of the gaze for this person; the z axis must point up.
/// 3. Each component is divided among the surfaces: density in the plane of a face, times the share of it that straight paths from the hand (or
///    from the eyes) meet first, times the sine of the angle of incidence. Untouchable surfaces block paths.
/// 4. For each surface the components add up to a probability and a covariance; the point is the mean of those that agree with the most probable
///    one.
///
/// Estimates of successive samples share their history, and a fixation has one error, not one per sample. So no densities are multiplied over time:
/// a prediction depends on the estimate and the two fixations at that time. During saccades, or up to 0.3 s of lost gaze, the last fixation is
/// still used. An estimator trained with gaze ([`LearnedConfig::gaze`](crate::LearnedConfig::gaze)) is better than the line of sight alone once the
/// hand moves.
///
/// The registration error between tracker and scene widens every component, and every covariance across its surface.
///
/// A hand at rest on a surface touches it: that surface comes first, with the registration error as its covariance and time 0, and a tenth of the
/// probability goes to all other surfaces. This ends when the hand is faster than the onset of a reach or further away than a few registration
/// errors. A hand that has passed through a surface touches that surface, from the side it came from.
///
/// If the evidence points at no surface, a [`DeterministicPredictor`] takes over. It also takes over if the estimator had too little training
/// ([`FusedPredictor::experience`]). After the first samples nothing is allocated, except by the estimator.
#[derive(Debug, Clone)]
pub struct FusedPredictor<E> {
    stream: StreamEstimator<E>,
    config: FusedConfig,
    gaze: GazeMemory,
    shares: SurfaceShares,
    side: SideWatch,
    rest: RestWatch,
    touch: TouchWatch,
    places: TouchedPlaces,
    person: Person,
    /// The evidence model with the gaze error of this person.
    evidence: EvidenceModel,
    /// Does the last sample belong to a reach with an estimate of its end?
    in_reach: bool,
    estimate: Option<ContactEstimate>,
    fallback: DeterministicPredictor,
    /// A reported touch that has not been processed yet.
    felt: Option<Felt>,
    /// Predictions of the last sample, the most probable first.
    ranked: Vec<ContactPrediction>,
}

impl<E: ContactEstimator> FusedPredictor<E> {
    /// A predictor without any samples.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(estimator: E, config: FusedConfig) -> Result<Self, ContactError> {
        config.validate()?;
        Ok(Self {
            stream: StreamEstimator::new(estimator, config.watch)?,
            shares: SurfaceShares::new(config.rays),
            fallback: DeterministicPredictor::new(config.fallback)?,
            felt: None,
            evidence: config.evidence,
            in_reach: false,
            config,
            gaze: GazeMemory::default(),
            side: SideWatch::default(),
            rest: RestWatch::default(),
            touch: TouchWatch::default(),
            places: TouchedPlaces::default(),
            person: Person::default(),
            estimate: None,
            ranked: Vec::with_capacity(16),
        })
    }

    /// The predictions of the last sample, the most probable place first.
    #[must_use]
    pub fn ranked(&self) -> &[ContactPrediction] {
        &self.ranked
    }

    /// The estimate of the last sample, before gaze and scene; `None` at rest.
    #[must_use]
    pub const fn estimate(&self) -> Option<&ContactEstimate> {
        self.estimate.as_ref()
    }

    /// The estimator in use.
    #[must_use]
    pub const fn estimator(&self) -> &E {
        self.stream.estimator()
    }

    /// Has the estimator enough training to be used?
    #[must_use]
    pub fn experience(&self) -> Experience {
        let needed = self.config.least_reaches;
        match self.stream.estimator().training_reaches() {
            Some(reaches) if reaches < needed => Experience::TooLittle { reaches, needed },
            _ => Experience::Enough,
        }
    }

    /// Learns from the reported touch if the hand was near the predicted surface; the contact is then taken to be on that surface.
    fn learn_touch(&mut self, scene: &Scene) {
        let Some(Felt {
            seen_m,
            surface,
            t_s,
        }) = self.felt.take()
        else {
            return;
        };
        let closest = scene.project_on(surface, seen_m).ok();
        let Some(closest) = closest.filter(|closest| closest.distance_m <= TOUCHED_M) else {
            return;
        };
        let place = SurfacePlace {
            surface,
            point_m: closest.point_m,
            normal: closest.normal,
        };
        if self.touch.felt(&place, t_s) {
            self.learn(&place);
        }
    }

    /// Divides every source among the faces. Returns whether any face was met.
    fn divide(&mut self, scene: &Scene, hand: &HandState, side: &FreeSide) -> bool {
        self.shares.clear();
        let registration_m2 = isotropic(self.config.registration_sd_m);
        let settings = (&self.config.watch, self.config.default_sd_m);
        let any = self.places.any();
        let model = self.evidence;
        let sample = Sample::new(hand, &self.stream, &self.gaze, any, &model, settings);
        let Some(sample) = sample else { return false };
        self.in_reach = sample.motion.is_some();
        let weights = self.person.shares(&sample, &model);
        let sights = sample.dwells.map(|dwell| {
            let ray = dwell?.ray;
            scene.ray_cast(ray.origin_m, ray.direction).ok()?
        });
        for (source, weight) in EvidenceSource::ALL.into_iter().zip(weights) {
            if weight.is_nan() || weight <= NEGLIGIBLE {
                continue;
            }
            let dwell = |i: usize| {
                let dwell = sample.dwells[i]?;
                let distance_m = sights[i].map_or(NOMINAL_FIXATION_M, |hit| hit.distance_m);
                let gaussian = sample.along(&dwell, model.on_target_sd_rad, Some(distance_m))?;
                Some((gaussian, self.seen(scene, hand, side, sights[i])))
            };
            let (gaussian, seen) = match source {
                EvidenceSource::Motion => (sample.end(&model), None),
                EvidenceSource::MotionAndFixation => {
                    let seen = self.seen(scene, hand, side, sights[0]);
                    (sample.confirmed(&model), Some(seen))
                }
                EvidenceSource::Fixation => dwell(0).unzip(),
                EvidenceSource::PreviousFixation => dwell(1).unzip(),
                EvidenceSource::Anywhere => (sample.anywhere(&model), None),
                EvidenceSource::TouchedBefore => {
                    self.add_places(scene, &sample, weight);
                    continue;
                }
            };
            let gaussian = gaussian.and_then(|g| g.widened(registration_m2));
            let Some(gaussian) = gaussian else { continue };
            let from = self.viewpoint(hand, side, &sample, source);
            let part = (source, &gaussian, weight);
            let met = self.shares.add(scene, &from, part, seen.flatten());
            if !met && source == EvidenceSource::Motion {
                let radius_m = 4.0 * gaussian.sd_m();
                self.shares.add_closest(scene, side.from_m, part, radius_m);
            }
        }
        self.shares.compare()
    }

    /// The person may look at a surface whose straight path from the hand is blocked.
    fn seen(
        &self,
        scene: &Scene,
        hand: &HandState,
        side: &FreeSide,
        hit: Option<Hit>,
    ) -> Option<SeenFace> {
        let hit = hit?;
        let near = hit.point_m.distance(hand.point_m) <= self.config.max_distance_m;
        (near && scene.surface(hit.surface).touchable()).then(|| SeenFace {
            hit: Hit {
                normal: facing(hit.normal, side.from_m - hit.point_m),
                ..hit
            },
            share: ROUND_ABOUT_SHARE,
        })
    }

    /// Adds the places touched before, unless the hand is still at one. Skips places whose surface has moved away, e.g. a door.
    fn add_places(&mut self, scene: &Scene, sample: &Sample, weight: f64) {
        if self.touch.is_touching() {
            return;
        }
        let registration_m2 = isotropic(self.config.registration_sd_m);
        let astray = sample.motion.map(|[_, astray]| astray);
        for (share, place) in self.places.shares(astray.as_ref()) {
            let (Some(on), Some(gaussian)) = (place.on, place.gaussian()) else {
                continue;
            };
            let closest = scene.project_on(on.surface, place.point_m);
            let is_there = closest.is_ok_and(|closest| closest.distance_m <= LEFT_M);
            if is_there && share * weight > NEGLIGIBLE {
                let on = SurfacePlace {
                    point_m: place.point_m,
                    ..on
                };
                let gaussian = gaussian.widened(registration_m2).unwrap_or(gaussian);
                let source = (EvidenceSource::TouchedBefore, share * weight);
                self.shares.add_place(&on, &gaussian, source);
            }
        }
    }

    /// Origin from which the surfaces of a source are visible. A moving hand meets whatever lies on its path. A hand that has no direction yet may
    /// go to anything the person sees.
    fn viewpoint(
        &self,
        hand: &HandState,
        side: &FreeSide,
        sample: &Sample,
        source: EvidenceSource,
    ) -> Viewpoint {
        let by_motion = sample.motion.is_some()
            && !matches!(
                source,
                EvidenceSource::Fixation | EvidenceSource::PreviousFixation
            );
        let (origin_m, heading) = match sample.dwells[0] {
            Some(dwell) if !by_motion => (dwell.ray.origin_m, Some(dwell.ray.direction)),
            _ => {
                let slow_m_per_s = self.config.watch.offset_m_per_s;
                let moves = by_motion || hand.velocity_m_per_s.length() > slow_m_per_s;
                (side.from_m, hand.direction.filter(|_| moves))
            }
        };
        Viewpoint {
            origin_m,
            heading,
            max_distance_m: self.config.max_distance_m + origin_m.distance(hand.point_m),
        }
    }

    /// Is a place within the error of the line of sight?
    fn is_looked_at(&self, ray: &GazeRay, point_m: DVec3) -> bool {
        let ray = gaze_error::without(ray, self.evidence.gaze_bias_rad);
        let angle_rad = ray.direction.angle_between(point_m - ray.origin_m);
        angle_rad <= self.evidence.apart_rad()
    }

    /// Learns from a touch of a place.
    fn learn(&mut self, place: &SurfacePlace) {
        let (people, own) = (&self.config.evidence, &mut self.evidence);
        self.person
            .touched(place.point_m, &self.places, people, own);
        self.places.touched(place.point_m, Some(*place));
    }
}

/// A reported touch: the tracked position, m, the predicted surface, and the time, s.
#[derive(Debug, Clone, Copy)]
struct Felt {
    seen_m: DVec3,
    surface: SurfaceId,
    t_s: f64,
}

/// Whether an estimator has enough training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experience {
    /// Enough: it is used.
    Enough,
    /// Too little training: the gaze ray is used instead.
    TooLittle {
        /// Number of training reaches of the estimator.
        reaches: usize,
        /// The required number ([`FusedConfig::least_reaches`]).
        needed: usize,
    },
}

/// Components with a lower weight are left out.
const NEGLIGIBLE: f64 = 0.005;

/// Assumed distance of the fixated point if the line of sight meets nothing, m.
const NOMINAL_FIXATION_M: f64 = 0.8;

/// A touched place further than this from its surface is ignored, m: for example, a door has moved.
const LEFT_M: f64 = 0.03;

/// Share of fixated places that can be reached although the straight path from the hand is blocked.
const ROUND_ABOUT_SHARE: f64 = 0.1;

/// A touch is learned from if the hand was within this distance of the surface, m.
const TOUCHED_M: f64 = 0.08;

impl<E: ContactEstimator> Predictor for FusedPredictor<E> {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.learn_touch(scene);
        self.ranked.clear();
        let finite = |e: &ContactEstimate| e.point_m.is_finite();
        self.estimate = self.stream.step(input.frame, input.hand).filter(finite);
        let apart_rad = self.evidence.apart_rad();
        self.gaze.step(input.frame.t_s, &input.gaze, apart_rad);
        // Follow every sample, so that the fallback can take over at any time.
        let followed = self.fallback.follow(scene, input);
        let usable = |h: &&HandState| {
            h.t_s.is_finite() && h.point_m.is_finite() && h.velocity_m_per_s.is_finite()
        };
        let Some(hand) = input.hand.filter(usable) else {
            self.rest.forget();
            return &self.ranked;
        };
        if self.experience() == Experience::Enough {
            let eye_m = self.gaze.now().map(|dwell| dwell.ray.origin_m);
            let side = self.side.free_side(scene, hand, eye_m);
            let registration_sd_m = self.config.registration_sd_m;
            let watch = &self.config.watch;
            let touched = self.rest.rest(scene, hand, &side, registration_sd_m, watch);
            // Learn from the touch before this sample is used, because the sample belongs to the touch.
            if let Some(place) = self.touch.step(hand, &side, touched.as_ref()) {
                self.learn(&place);
            }
            let met = self.divide(scene, hand, &side);
            if met || touched.is_some() {
                self.rank(scene, hand, side.behind.is_some(), touched);
            }
        }
        if self.ranked.is_empty() {
            let by_ray = followed.and_then(|f| self.fallback.contact(scene, hand, f));
            self.ranked.extend(by_ray);
        }
        &self.ranked
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        self.stream.touched(contact_m, contact_s);
        self.felt = self.ranked.first().map(|first| Felt {
            seen_m: contact_m,
            surface: first.surface,
            t_s: contact_s,
        });
    }

    fn reset(&mut self) {
        self.stream.reset();
        self.gaze.forget();
        self.side.forget();
        self.rest.forget();
        self.touch = TouchWatch::default();
        self.places.forget();
        (self.person, self.evidence) = (Person::default(), self.config.evidence);
        self.fallback.reset();
        self.felt = None;
        self.in_reach = false;
        self.estimate = None;
        self.ranked.clear();
    }
}
