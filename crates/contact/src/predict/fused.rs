//! Prediction from all evidence: the hand's motion, the gaze, the surfaces and the time.

use super::deterministic::{DeterministicConfig, DeterministicPredictor};
use super::gaussian::Gaussian;
use super::gaze_model::{GazeMemory, GazeModel};
use super::prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
use super::resting::{RestWatch, SurfacePlace};
use super::stream::StreamEstimator;
use super::surface_shares::{Face, SeenFace, SurfaceShares, Viewpoint};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::outer_product::square;
use glam::{DMat3, DVec3};
use hwall_hand::{HandState, WatchConfig};
use hwall_numeric::check::{non_negative, positive, that};
use hwall_scene::{Hit, Scene, SurfaceId};

/// Settings of a [`FusedPredictor`].
#[derive(Debug, Clone, PartialEq)]
pub struct FusedConfig {
    /// How people look while they reach. It is worth fitting to the eye tracker in use.
    pub gaze: GazeModel,
    /// What begins and ends a reach.
    pub watch: WatchConfig,
    /// Standard deviation of an estimate that comes without a covariance, in each axis, m. Default 0.1.
    pub default_sd_m: f64,
    /// Standard deviation of the registration of the tracker to the scene in each axis, m. It adds to every
    /// covariance, and a hand at rest within a few of it from a surface is on that surface. Default 0.008;
    /// measure it with [`RigidFit`](hwall_hand::RigidFit), and take 0 for simulations. It shifts hand, gaze
    /// and estimate alike, so it does not move them apart.
    pub registration_sd_m: f64,
    /// How far beside its direction of motion a hand touches, as a share of the way left: standard deviation
    /// in each of two directions. `None` ignores the direction of motion. Default 0.25: on simulated
    /// reaches it takes a third off the error of a regression at 90 % of the time. The learned estimator
    /// knows the direction itself; its 50 / 70 / 90 % regions hold 64 / 80 / 91 % of simulated contacts with
    /// this and 64 / 78 / 92 % without (no error of registration), so the direction is not counted twice.
    pub bend: Option<f64>,
    /// Where a hand at rest may touch next: standard deviation about the hand in each axis, m. Default 0.4.
    pub rest_sd_m: f64,
    /// Probability that a hand at rest on a surface is about to leave for another one, in [0, 1). It is
    /// divided among the others as for a hand at rest elsewhere. Default 0.1.
    pub leaving_share: f64,
    /// Surfaces further than this from the hand are not about to be touched, m. Default 1.5.
    pub max_distance_m: f64,
    /// Most rays for each hypothesis; only seven are cast for one that weighs little, or that is narrow and
    /// meets one plane alone. Default 19; take more for scenes of many small surfaces.
    pub rays: usize,
    /// Share of the places looked at that can be reached although the straight way from the hand is
    /// blocked, in [0, 1). Default 0.1.
    pub round_about_share: f64,
    /// Predictions below this probability are left out, except the best one; the rest add up to 1 again. In
    /// [0, 1). Default 0.005.
    pub min_probability: f64,
    /// The predictor used when no surface lies where the evidence points.
    pub fallback: DeterministicConfig,
}

impl Default for FusedConfig {
    fn default() -> Self {
        Self {
            gaze: GazeModel::default(),
            watch: WatchConfig::default(),
            default_sd_m: 0.1,
            registration_sd_m: 0.008,
            bend: Some(0.25),
            rest_sd_m: 0.4,
            leaving_share: 0.1,
            max_distance_m: 1.5,
            rays: 19,
            round_about_share: 0.1,
            min_probability: 0.005,
            fallback: DeterministicConfig::ray_led(),
        }
    }
}

/// Fuses an estimate of where the hand's motion ends with the gaze and the surfaces of the scene.
///
/// For every sample:
/// 1. The estimator gives N(m, C) for the contact point. It is narrowed across the direction of motion
///    in proportion to the way left to the next surface; a hand at rest may touch anywhere near.
/// 2. The gaze makes it a mixture of three hypotheses: the Gaussian times a Gaussian about the present line of
///    sight, the same about the fixation before, and the Gaussian alone, for a person who does not look at
///    the target. Each is weighed by how probable it makes both lines of sight ([`GazeModel`]). One
///    estimate in ten is assumed to be three times as far off as it states, so that a look far away from it
///    still counts.
/// 3. Each hypothesis is divided among the surfaces: density in the plane of a face, times the share of it
///    that straight ways from the hand meet first, times the sine of the angle at which they meet it.
///    Surfaces that cannot be touched block the way.
/// 4. For each surface the parts add up to a probability and a covariance; the point is the mean of those
///    that agree with the most probable one.
///
/// Estimates of successive samples share their history, and a fixation has one error, not one per sample.
/// So nothing is multiplied over time: a prediction follows from the estimate and the two fixations at that
/// time. A change of mind is followed as fast as the estimator and the eyes follow it.
///
/// The error of registration of the tracker to the scene widens every part of the mixture and every covariance
/// across its surface, so covariances are positive definite. The covariance of a surface mixes all parts that
/// end there. For a hand at rest on nothing it is as wide as what that hand may do.
///
/// A hand at rest on a surface touches it: that surface comes first, with the error of registration as its
/// covariance and time 0, and `leaving_share` goes to all other surfaces, until the hand is faster than the
/// onset of a reach or further away than a few errors of registration.
///
/// The estimator's normal is not used: faces have exact ones, and the point and the direction of motion already
/// tell which is meant.
///
/// A hand that has gone through a surface touches that surface, from the side it came from. When no surface
/// lies where the evidence points, a [`DeterministicPredictor`] takes over. Nothing is allocated after the
/// first samples, except by the estimator.
#[derive(Debug, Clone)]
pub struct FusedPredictor<E> {
    stream: StreamEstimator<E>,
    config: FusedConfig,
    gaze: GazeMemory,
    shares: SurfaceShares,
    rest: RestWatch,
    estimate: Option<ContactEstimate>,
    fallback: DeterministicPredictor,
    /// Of the last sample, the most probable first.
    ranked: Vec<ContactPrediction>,
}

impl<E: ContactEstimator> FusedPredictor<E> {
    /// A predictor that has seen nothing.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(estimator: E, config: FusedConfig) -> Result<Self, ContactError> {
        config.gaze.validate()?;
        positive("default_sd_m", config.default_sd_m)?;
        non_negative("registration_sd_m", config.registration_sd_m)?;
        positive("rest_sd_m", config.rest_sd_m)?;
        config.bend.map_or(Ok(0.0), |bend| positive("bend", bend))?;
        positive("max_distance_m", config.max_distance_m)?;
        positive("rays", config.rays as f64)?;
        for (what, value) in [
            ("leaving_share", config.leaving_share),
            ("round_about_share", config.round_about_share),
            ("min_probability", config.min_probability),
        ] {
            that((0.0..1.0).contains(&value), what, value, "in [0, 1)")?;
        }
        Ok(Self {
            stream: StreamEstimator::new(estimator, config.watch)?,
            shares: SurfaceShares::new(config.rays),
            fallback: DeterministicPredictor::new(config.fallback)?,
            config,
            gaze: GazeMemory::default(),
            rest: RestWatch::default(),
            estimate: None,
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

    /// The contact point by the motion alone: about the estimate, or about a hand at rest.
    fn by_motion(&self, hand: &HandState) -> Option<ByMotion> {
        let spread = |covariance: Option<DMat3>| {
            let sd = self.config.default_sd_m;
            covariance.unwrap_or(DMat3::from_diagonal(DVec3::splat(sd * sd)))
        };
        let estimated = self
            .estimate
            .and_then(|e| Gaussian::new(e.point_m, spread(e.covariance_m2)));
        match estimated {
            Some(gaussian) => Some(ByMotion::Estimated(gaussian)),
            None => Gaussian::ball(hand.point_m, self.config.rest_sd_m).map(ByMotion::AtRest),
        }
    }

    /// The estimate narrowed by the direction of motion: the rest of the way is nearly straight, so
    /// the contact lies beside the line ahead by a share of the distance to the first surface on
    /// it. The estimator knows the direction but cannot know that distance.
    fn straight_on(
        &self,
        scene: &Scene,
        hand: &HandState,
        by_motion: &Gaussian,
    ) -> Option<Gaussian> {
        let ahead = hand.direction?;
        let hit = scene.ray_cast(hand.point_m, ahead).ok()??;
        // A surface that the hand only passes does not end the way.
        let left_m = hit
            .distance_m
            .max((by_motion.mean_m - hand.point_m).dot(ahead));
        let sd_m = self.config.bend? * left_m + TRACKED_M;
        let across = DMat3::IDENTITY - square(ahead);
        by_motion.times(hand.point_m, across * (1.0 / (sd_m * sd_m)))
    }

    /// Finds the faces of every hypothesis. Returns whether any is met.
    fn divide(&mut self, scene: &Scene, hand: &HandState, origin_m: DVec3) -> bool {
        self.shares.clear();
        let (gaussian, moving) = match self.by_motion(hand) {
            None => return false,
            Some(ByMotion::AtRest(gaussian)) => (gaussian, false),
            Some(ByMotion::Estimated(estimated)) => {
                let narrowed = self.straight_on(scene, hand, &estimated);
                (narrowed.unwrap_or(estimated), true)
            }
        };
        // A resting hand has no direction yet: it may go to whatever the person sees.
        let (from_m, heading) = match (moving, self.gaze.ray()) {
            (false, Some(ray)) => (ray.origin_m, Some(ray.direction)),
            _ => (origin_m, hand.direction),
        };
        let from = Viewpoint {
            origin_m: from_m,
            heading,
            max_distance_m: self.config.max_distance_m + from_m.distance(hand.point_m),
        };
        let hypotheses = self.config.gaze.weigh(&gaussian, &self.gaze, hand.t_s);
        for hypothesis in hypotheses.into_iter().flatten() {
            // What the line of sight meets may be meant although the straight way there is blocked.
            let seen = hypothesis.sight.and_then(|ray| {
                let hit = scene.ray_cast(ray.origin_m, ray.direction).ok()??;
                let near = hit.point_m.distance(hand.point_m) <= self.config.max_distance_m;
                (near && scene.surface(hit.surface).touchable()).then(|| SeenFace {
                    hit: facing(&hit, origin_m),
                    share: self.config.round_about_share,
                })
            });
            let Some(registered) = hypothesis.gaussian.widened(self.config.registration_sd_m)
            else {
                continue;
            };
            self.shares
                .add(scene, &from, &registered, hypothesis.weight, seen);
        }
        if self.shares.compare() {
            return true;
        }
        if moving {
            // The estimate lies beyond the edges of all surfaces.
            let radius_m = 4.0 * gaussian.sd_m();
            self.shares
                .add_closest(scene, origin_m, &gaussian, radius_m);
        }
        self.shares.compare()
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
            let off_plane_m = self.config.registration_sd_m.hypot(LEAST_SD_M);
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
                normal,
                roughness: scene.surface(face.surface).roughness,
                distance_m,
                time_to_contact_s: self.time_to(hand, point_m, behind && distance_m <= 0.0),
                probability: p,
                source: match (self.estimate, self.gaze.ray()) {
                    (Some(_), _) => PredictionSource::Motion,
                    (None, Some(_)) => PredictionSource::Gaze,
                    (None, None) => PredictionSource::Nearest,
                },
            });
        }
        if let Some(touched) = touched {
            let sd_m = self.config.registration_sd_m.hypot(LEAST_SD_M);
            self.ranked.push(ContactPrediction {
                surface: touched.surface,
                point_m: touched.point_m,
                covariance_m2: Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))),
                normal: touched.normal,
                roughness: scene.surface(touched.surface).roughness,
                distance_m: (hand.point_m - touched.point_m).dot(touched.normal),
                time_to_contact_s: Some(NOW),
                probability: 1.0 - probability,
                source: PredictionSource::Nearest,
            });
            probability = 1.0;
        }
        self.ranked
            .iter_mut()
            .for_each(|a| a.probability /= probability);
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

/// The contact point by the motion of the hand alone.
enum ByMotion {
    /// About the estimate.
    Estimated(Gaussian),
    /// About a hand at rest, which may touch anywhere near.
    AtRest(Gaussian),
}

/// The hand is there.
const NOW: TimeToContact = TimeToContact {
    mean_s: 0.0,
    sd_s: None,
};

/// Longest time that is predicted from the speed of the hand, s.
const LONGEST_S: f64 = 2.0;

/// Least standard deviation of a prediction, m, so that no covariance is singular.
const LEAST_SD_M: f64 = 1e-3;

/// Faces agree on a place when it is no further apart than this many times their summed variance.
const AGREE: f64 = 1.0;

/// Error of the tracked point across its motion, filter included, m.
const TRACKED_M: f64 = 0.004;

/// The hit with its normal towards a point.
fn facing(hit: &Hit, towards_m: DVec3) -> Hit {
    let sign = (towards_m - hit.point_m).dot(hit.normal);
    Hit {
        normal: if sign < 0.0 { -hit.normal } else { hit.normal },
        ..*hit
    }
}

/// Mean and covariance of a contact by the faces of one surface.
struct Moments {
    /// Of the faces that agree with the best one, m: between two places that a person may mean, neither is
    /// touched.
    mean_m: DVec3,
    /// About that mean, of all faces, m²: positive semidefinite, as that of every face is.
    covariance_m2: DMat3,
}

impl Moments {
    fn of<'a, I: Iterator<Item = &'a Face>>(faces: impl Fn() -> I, best: &Face) -> Self {
        let agree = |f: &&Face| {
            let sum = f.covariance_m2 + best.covariance_m2;
            let variance_m2 = sum.x_axis.x + sum.y_axis.y + sum.z_axis.z;
            f.mean_m.distance_squared(best.mean_m) <= AGREE * variance_m2
        };
        let agreed = || faces().filter(agree);
        let mean_m = agreed().map(|f| f.mean_m * f.mass).sum::<DVec3>()
            / agreed().map(|f| f.mass).sum::<f64>();
        let weight: f64 = faces().map(|f| f.mass).sum();
        let covariance_m2 = faces()
            .map(|f| (f.covariance_m2 + square(f.mean_m - mean_m)) * (f.mass / weight))
            .fold(DMat3::ZERO, |sum, c| sum + c);
        Self {
            mean_m,
            covariance_m2,
        }
    }
}

impl<E: ContactEstimator> Predictor for FusedPredictor<E> {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.ranked.clear();
        let finite = |e: &ContactEstimate| e.point_m.is_finite();
        self.estimate = self.stream.step(input.frame, input.hand).filter(finite);
        self.gaze.step(
            input.frame.t_s,
            input.gaze.ray(),
            self.config.gaze.saccade_rad(),
        );
        let usable = |h: &&HandState| h.point_m.is_finite() && h.velocity_m_per_s.is_finite();
        let Some(hand) = input.hand.filter(usable) else {
            self.rest.forget();
            return &self.ranked;
        };
        let eye_m = self.gaze.ray().map(|ray| ray.origin_m);
        let side = self.rest.free_side(scene, hand.point_m, eye_m);
        let touched = self.rest.rest(
            scene,
            hand,
            &side,
            self.config.registration_sd_m,
            &self.config.watch,
        );
        let met = self.divide(scene, hand, side.from_m);
        if met || touched.is_some() {
            self.rank(scene, hand, side.behind.is_some(), touched);
        }
        if self.ranked.is_empty() {
            let fallback = self.fallback.predict(scene, input);
            self.ranked.extend_from_slice(fallback);
        }
        &self.ranked
    }

    fn reset(&mut self) {
        self.stream.reset();
        self.gaze.forget();
        self.rest.forget();
        self.estimate = None;
        self.ranked.clear();
    }
}
