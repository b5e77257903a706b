//! Prediction from all evidence: the hand's motion, the gaze, the surfaces and the time.

use super::deterministic::DeterministicPredictor;
use super::face_moments::Moments;
use super::fused_config::FusedConfig;
use super::gaussian::{Gaussian, isotropic};
use super::gaze::idle::IdlePlaces;
use super::gaze::memory::GazeMemory;
use super::gaze::weights::{ASTRAY_SHARE, ASTRAY_STRETCH, ByHand, Hypothesis};
use super::hand::free_side::{FreeSide, SideWatch};
use super::hand::place::{HandPlace, by_motion_alone, close, gaussian_of, near};
use super::hand::resting::{RestWatch, SurfacePlace};
use super::hand::straight_way::StraightWay;
use super::prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
use super::regions::{InPlaneError, RegionSizes};
use super::repeats::Repeats;
use super::stream::StreamEstimator;
use super::surface_shares::{Evidence, Face, SeenFace, SurfaceShares, Viewpoint};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::outer_product::square;
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
/// covariance and time 0, and `leaving_share` goes to all other surfaces, until the hand is faster than the
/// onset of a reach or further away than a few errors of registration.
///
/// While no gaze is seen, the places that this person has touched before count, too. Touches are those that are
/// [felt](Predictor::touched), those of a hand that rests on a surface, and those of one that goes through a surface that nothing
/// stands for. They say how often this person comes back, how good predictions of this person have been, and whether they were better with
/// those places than without; covariances grow for a person of whom predictions were worse than they said. The place
/// that probably comes next is named beside the others ([`PredictionSource::TouchedBefore`]).
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

    /// The same, for touches that are measured elsewhere, as by an arm that feels where its board is pressed.
    pub const fn registration_mut(&mut self) -> Option<&mut RegistrationEstimator> {
        self.registration.as_mut()
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
            Some(_) => {
                let [xx, _, _, _, yy, _, _, _, zz] = self.registration_m2.to_cols_array();
                ((xx + yy + zz) / 3.0).sqrt()
            }
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
                    hit: facing(&hit, side.from_m),
                    share: self.config.round_about_share,
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

    /// Adds up the faces of each surface; a surface that the hand rests on is added separately.
    fn rank(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        behind: bool,
        touched: Option<SurfacePlace>,
    ) {
        let faces = self.shares.faces();
        let total: f64 = faces.iter().map(|f| f.mass).sum();
        let others = touched.map_or(1.0, |_| self.config.leaving_share);
        let look = self.gaze.now();
        let looked_at_since_s = look.map(|look| look.since_s);
        let looked_at = faces.iter().filter(|f| f.evidence.looked_at());
        let on_target = looked_at.map(|f| f.mass).sum::<f64>() / total;
        self.look = look.map(|look| TargetLook {
            since_s: look.since_s,
            age_s: look.age_s(hand.t_s),
            probability: if total > 0.0 { others * on_target } else { 0.0 },
        });
        let of = |surface: SurfaceId| faces.iter().filter(move |f| f.surface == surface);
        let weight_of = |surface: SurfaceId| of(surface).map(|f| f.mass).sum::<f64>();
        let is_touched = |f: &Face| touched.is_some_and(|t| t.surface == f.surface);
        let first = |index: usize, f: &Face| faces[..index].iter().all(|g| g.surface != f.surface);
        let best_weight = faces
            .iter()
            .map(|f| weight_of(f.surface))
            .fold(0.0, f64::max);
        let least = if touched.is_some() {
            self.config.min_probability * total / others
        } else {
            (self.config.min_probability * total).min(best_weight)
        };
        let mut probability = 0.0;
        for (index, face) in faces.iter().enumerate() {
            if is_touched(face) || !first(index, face) {
                continue;
            }
            let weight = weight_of(face.surface);
            if weight < least {
                continue;
            }
            let Some(best) = of(face.surface).max_by(|a, b| a.mass.total_cmp(&b.mass)) else {
                continue;
            };
            let moments = Moments::of(|| of(face.surface), best);
            let met = SurfacePlace {
                surface: face.surface,
                point_m: best.met_m,
                normal: best.normal,
            };
            let SurfacePlace {
                point_m, normal, ..
            } = met.below(scene, moments.mean_m).unwrap_or(met);
            let off_plane_m = self.registration_across_m(best.normal).hypot(LEAST_SD_M);
            let covariance_m2 = moments.covariance_m2
                + square(point_m - moments.mean_m)
                + square(best.normal * off_plane_m);
            let distance_m = (hand.point_m - point_m).dot(normal);
            let p = others * weight / total;
            probability += p;
            self.ranked.push(ContactPrediction {
                surface: face.surface,
                point_m,
                covariance_m2: Some(covariance_m2),
                regions: self.regions(hand.point_m.distance(point_m), &covariance_m2, normal),
                normal,
                roughness: scene.surface(face.surface).roughness,
                distance_m,
                time_to_contact_s: self.time_to(hand, point_m, behind && distance_m <= 0.0),
                probability: p,
                source: match best.evidence {
                    Evidence::Motion { .. } => PredictionSource::Motion,
                    Evidence::Gaze { .. } => PredictionSource::Gaze,
                    Evidence::Nearness => PredictionSource::Nearest,
                },
                looked_at_since_s: looked_at_since_s.filter(|_| best.evidence.looked_at()),
            });
        }
        if let Some(touched) = touched {
            let covariance_m2 = self.registration_m2 + isotropic(LEAST_SD_M);
            self.ranked.push(ContactPrediction {
                surface: touched.surface,
                point_m: touched.point_m,
                covariance_m2: Some(covariance_m2),
                regions: RegionSizes::NORMAL,
                normal: touched.normal,
                roughness: scene.surface(touched.surface).roughness,
                distance_m: (hand.point_m - touched.point_m).dot(touched.normal),
                time_to_contact_s: Some(NOW),
                probability: 1.0 - probability,
                source: PredictionSource::Nearest,
                looked_at_since_s: None,
            });
            probability = 1.0;
        }
        self.ranked
            .iter_mut()
            .for_each(|a| a.probability /= probability);
        self.ranked
            .sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    /// The sizes of regions: learnt from hands that reach, with what is left of the error of registration beside that.
    fn regions(&self, way_m: f64, covariance_m2: &DMat3, normal: DVec3) -> RegionSizes {
        let Some(model) = self.config.regions.filter(|_| self.estimate.is_some()) else {
            return RegionSizes::NORMAL;
        };
        InPlaneError::new(covariance_m2, &self.registration_m2, normal).sizes(&model.at(way_m))
    }

    /// What a prediction of the last sample is unsure of, by itself and by the registration; `None` without a covariance.
    pub(in crate::predict) fn in_plane_error(
        &self,
        prediction: &ContactPrediction,
    ) -> Option<InPlaneError> {
        let covariance_m2 = prediction.covariance_m2?;
        Some(InPlaneError::new(
            &covariance_m2,
            &self.registration_m2,
            prediction.normal,
        ))
    }

    /// Of a person whose gaze is not seen: where they touch again what they have touched before.
    fn add_repeat(&mut self, scene: &Scene, hand: &HandState) {
        let (now, before) = self.gaze.looks(hand.t_s, self.config.gaze.memory_s);
        if now.is_some() || before.is_some() {
            return;
        }
        let off_m = |place: &SurfacePlace| {
            let closest = scene.project_on(place.surface, place.point_m);
            closest.ok().map(|closest| closest.distance_m)
        };
        let repeat = self.repeats.likeliest(hand.t_s, &self.ranked, off_m);
        let scale = self.repeats.scale();
        let motions = self
            .ranked
            .iter_mut()
            .filter(|p| p.source == PredictionSource::Motion);
        for covariance_m2 in motions.filter_map(|p| p.covariance_m2.as_mut()) {
            *covariance_m2 *= scale;
        }
        let Some(repeat) = repeat else { return };
        for other in &mut self.ranked {
            other.probability *= 1.0 - repeat.probability;
        }
        let SurfacePlace {
            surface,
            point_m,
            normal,
        } = repeat.place;
        let off_plane_m = self.registration_across_m(normal).hypot(LEAST_SD_M);
        let across = square(normal);
        let along = DMat3::IDENTITY - across;
        self.ranked.push(ContactPrediction {
            covariance_m2: Some(along * repeat.along_m2 + across * (off_plane_m * off_plane_m)),
            roughness: scene.surface(surface).roughness,
            distance_m: (hand.point_m - point_m).dot(normal),
            time_to_contact_s: self.time_to(hand, point_m, false),
            probability: repeat.probability,
            source: PredictionSource::TouchedBefore,
            ..ContactPrediction::of_place(surface, point_m, normal)
        });
        self.ranked
            .sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    /// The estimator's time, else the time that a hand which clearly approaches takes.
    fn time_to(&self, hand: &HandState, point_m: DVec3, there: bool) -> Option<TimeToContact> {
        if there {
            return Some(NOW);
        }
        let usable = |t: &TimeToContact| t.mean_s.is_finite() && t.sd_s.is_none_or(f64::is_finite);
        let estimated = self
            .estimate
            .and_then(|e| e.time_to_contact_s)
            .filter(usable);
        estimated.or_else(|| {
            let way = point_m - hand.point_m;
            let closing = hand.velocity_m_per_s.dot(way.try_normalize()?);
            let mean_s = way.length() / closing;
            // A slower hand rests, and no reach takes longer.
            let clearly = closing > self.config.watch.offset_m_per_s && mean_s <= LONGEST_S;
            clearly.then_some(TimeToContact { mean_s, sd_s: None })
        })
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

/// The hand is there.
const NOW: TimeToContact = TimeToContact {
    mean_s: 0.0,
    sd_s: None,
};

/// Longest time that is predicted from the speed of the hand, s.
const LONGEST_S: f64 = 2.0;

/// A touch is told to the registration if the hand was seen this near to the surface, m.
const TOUCHED_M: f64 = 0.08;

/// Least standard deviation of a prediction, m, so that no covariance is singular.
const LEAST_SD_M: f64 = 1e-3;

/// The hit with its normal towards a point.
fn facing(hit: &Hit, towards_m: DVec3) -> Hit {
    let sign = (towards_m - hit.point_m).dot(hit.normal);
    Hit {
        normal: if sign < 0.0 { -hit.normal } else { hit.normal },
        ..*hit
    }
}

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
