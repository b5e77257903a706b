//! Prediction by a single ray, as in the dissertation.

use super::hand::free_side::{FreeSide, SideWatch};
use super::hand::resting::facing;
use super::prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
use crate::error::ContactError;
use crate::estimate::TimeToContact;
use crate::matrices::{axes_across, isotropic, square};
use glam::{DMat3, DVec3};
use hwall_hand::{Fixation, Gaze, GazeRay, HandState};
use hwall_numeric::check::positive;
use hwall_scene::{Hit, Scene, SurfaceId};

/// Settings of the deterministic predictor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeterministicConfig {
    /// Surfaces further than this from the hand are ignored, m. Default 1.5: an arm's length and a step. Without the limit, a fixation on a far wall
    /// would hide the panel under the hand.
    pub max_distance_m: f64,
    /// Does the ray that found the surface (gaze, or direction of motion) give the point while the hand is far? Above 0.06 m the point is the
    /// intersection of that ray with the surface. Within 0.02 m it is where the hand's own motion leads, or the hand's projection if the hand does
    /// not approach. In between it is a linear blend. Points given by gaze have a covariance, from 0.03 rad (1.7 degrees): an eye tracker of 1
    /// degree and a person of about the same accuracy. Default `false`: the point is always the projection of the hand, as in the dissertation,
    /// without covariance.
    pub ray_leads: bool,
}

impl Default for DeterministicConfig {
    fn default() -> Self {
        Self {
            max_distance_m: 1.5,
            ray_leads: false,
        }
    }
}

impl DeterministicConfig {
    /// Settings with [`ray_leads`](Self::ray_leads).
    ///
    /// People look at the target before the hand gets there, so an arm that is slower than the hand gains the time of the reach. The path of the
    /// hand is curved and becomes the better guide only at the very end: with the ray in use until 0.25 m instead, a simulated iiwa was in place at
    /// half as many touches.
    #[must_use]
    pub fn ray_led() -> Self {
        Self {
            ray_leads: true,
            ..Self::default()
        }
    }
}

/// The predictor of the dissertation (section III.C): the gaze ray gives the surface, the projection of the hand on it gives point and normal, and
/// the hand velocity gives the time.
///
/// Without gaze, or if the ray meets nothing touchable within reach, the ray along the hand's direction of motion gives the surface. If that meets
/// nothing either, the closest touchable surface is used. [`ContactPrediction::source`] states which of them it was. By default the point is always
/// the projection of the hand, so that the board does not jump when the source changes within one surface; [`DeterministicConfig::ray_led`] gives
/// that up for earlier points.
///
/// During saccades, or up to 0.3 s of lost gaze, the last fixated place is still used. A hand that has passed through a surface touches it from the
/// side it came from.
///
/// Known failures, kept as tests: If the gaze meets another object in front of the target, that object is predicted. Near a corner the prediction
/// changes wall as soon as the gaze does. A hand that approaches at a slant touches next to its projection, and the error grows with the distance.
/// Without gaze, a hand first seen after it has passed through a wall seems to be behind it.
///
/// It returns one surface, with probability 1: it has no uncertainty estimate.
#[derive(Debug, Clone, Default)]
pub struct DeterministicPredictor {
    config: DeterministicConfig,
    side: SideWatch,
    /// The last fixated place and its time.
    held: Option<(Aim, f64)>,
    prediction: Option<ContactPrediction>,
}

impl DeterministicPredictor {
    /// A predictor with these limits.
    ///
    /// # Errors
    /// A distance that is not positive and finite.
    pub fn new(config: DeterministicConfig) -> Result<Self, ContactError> {
        positive("max_distance_m", config.max_distance_m)?;
        Ok(Self {
            config,
            ..Self::default()
        })
    }

    /// First intersection of a ray with the scene, if touchable.
    fn aimed_at(scene: &Scene, origin_m: DVec3, direction: DVec3) -> Option<Aim> {
        // The scene rejects only rays that are not finite or have no direction.
        let hit = scene.ray_cast(origin_m, direction).ok().flatten()?;
        let aim = Aim {
            surface: hit.surface,
            point_m: Some(hit.point_m),
            fixation: None,
        };
        scene.surface(hit.surface).touchable().then_some(aim)
    }

    /// Projection of the hand on a surface, or the point given by the ray, unless out of reach.
    fn project(
        &self,
        scene: &Scene,
        Aim {
            surface,
            point_m: aimed_m,
            fixation,
        }: Aim,
        hand: &HandState,
        side: &FreeSide,
        source: PredictionSource,
    ) -> Option<ContactPrediction> {
        let hand_m = hand.point_m;
        let by_eye =
            fixation.and_then(|fixation| entry(scene, surface, fixation.ray.origin_m, hand_m));
        let behind = by_eye.or(side.behind.filter(|hit| hit.surface == surface));
        let (point_m, normal, distance_m) = match behind {
            Some(Hit {
                point_m: face_m,
                normal,
                ..
            }) => {
                // Project onto the face that the hand passed through: a thick wall also has a back.
                let foot_m = hand_m - normal * (hand_m - face_m).dot(normal);
                let point_m = scene.project_on(surface, foot_m).ok()?.point_m;
                (point_m, normal, (hand_m - point_m).dot(normal).min(0.0))
            }
            None => {
                let closest = scene.project_on(surface, hand_m).ok()?;
                (closest.point_m, closest.normal, closest.distance_m)
            }
        };
        if distance_m.abs() > self.config.max_distance_m {
            return None;
        }
        let time_to_contact_s = if behind.is_some() || distance_m <= ON_SURFACE_M {
            Some(0.0)
        } else {
            let closing = hand.velocity_m_per_s.dot(point_m - hand_m) / distance_m;
            (closing >= MIN_CLOSING_M_PER_S).then(|| distance_m / closing)
        };
        let mut led = 0.0;
        let (point_m, normal) = match self.config.ray_leads {
            true if distance_m > 0.0 => {
                let ahead_m = self
                    .ahead(scene, surface, hand, time_to_contact_s)
                    .unwrap_or(point_m);
                let share = ((distance_m - NEAR_M) / (FAR_M - NEAR_M)).clamp(0.0, 1.0);
                led = if aimed_m.is_some() { share } else { 0.0 };
                let place = scene
                    .project_on(surface, ahead_m.lerp(aimed_m.unwrap_or(ahead_m), share))
                    .ok()?;
                // The normal on the hand's side, whichever side the ray met.
                (place.point_m, facing(place.normal, normal))
            }
            _ => (point_m, normal),
        };
        let covariance_m2 = fixation
            .filter(|_| led > 0.0)
            .map(|fixation| {
                let by_gaze = sight_covariance_m2(&fixation, point_m, normal);
                let by_hand_m = (1.0 - led) * (BEND * distance_m + TRACKED_M);
                let in_plane = DMat3::IDENTITY - square(normal);
                let least_m2 = isotropic(LEAST_SD_M);
                by_gaze * (led * led) + in_plane * (by_hand_m * by_hand_m) + least_m2
            })
            // Extreme distances overflow.
            .filter(|c| c.is_finite());
        Some(ContactPrediction {
            surface,
            point_m,
            covariance_m2,
            normal,
            roughness: scene.surface(surface).roughness,
            distance_m,
            time_to_contact_s: time_to_contact_s.map(|mean_s| TimeToContact { mean_s, sd_s: None }),
            probability: 1.0,
            source,
            looked_at_since_s: fixation.map(|fixation| fixation.since_s),
        })
    }
}

impl DeterministicPredictor {
    /// Where a hand that clearly approaches a surface would meet it.
    fn ahead(
        &self,
        scene: &Scene,
        surface: SurfaceId,
        hand: &HandState,
        time_to_contact_s: Option<f64>,
    ) -> Option<DVec3> {
        let hit = scene.ray_cast(hand.point_m, hand.direction?).ok()??;
        let soon = time_to_contact_s? <= AHEAD_S;
        (soon && hit.surface == surface).then_some(hit.point_m)
    }
}

/// Largest distance of the closest touchable surface, the last resort, m.
const NEAREST_M: f64 = 0.3;
/// A slower approach counts as no approach, m/s: it may be the noise of a resting hand.
const MIN_CLOSING_M_PER_S: f64 = 0.02;
/// Below the first hand distance the hand's own motion gives the point, above the second the ray, m.
const NEAR_M: f64 = 0.02;
const FAR_M: f64 = 0.06;
/// Error of the line of sight about the target, standard deviation in each of two directions, rad; the noise of the fixation is added.
const GAZE_SD_RAD: f64 = 0.03;
/// A hand nearer than this lies on the surface, m: the remaining distance is rounding error without a direction.
const ON_SURFACE_M: f64 = 1e-9;

/// The direction of motion is used only this long before contact, s; earlier the hand still turns.
const AHEAD_S: f64 = 0.4;

/// Deviation of the touch from the direction of motion, as a share of the remaining distance, and the tracking error, m.
const BEND: f64 = 0.25;
const TRACKED_M: f64 = 0.004;
/// Least standard deviation of a point, m.
const LEAST_SD_M: f64 = 1e-3;
/// Least sine of the angle between line of sight and surface: bounds the error in the plane.
const LEAST_SLOPE: f64 = 0.05;
/// Time for which the last fixated place is used during saccades or gaze loss, s.
const HOLD_S: f64 = 0.3;

/// Observations of a sample before a prediction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Followed {
    looked_at: Option<Aim>,
    side: FreeSide,
}

/// A surface, the point where the ray meets it, and the fixation, if it was a gaze ray.
#[derive(Debug, Clone, Copy)]
struct Aim {
    surface: SurfaceId,
    point_m: Option<DVec3>,
    fixation: Option<Fixation>,
}

/// In-plane covariance of the intersection of a line of sight with a plane, from its angular error in each of two directions; at a slant the error
/// along the plane is many times larger.
fn sight_covariance_m2(fixation: &Fixation, point_m: DVec3, normal: DVec3) -> DMat3 {
    let GazeRay {
        origin_m,
        direction: sight,
    } = fixation.ray;
    let sd_m = GAZE_SD_RAD.hypot(fixation.noise_rad) * (point_m - origin_m).length();
    let slope = normal.dot(sight);
    let slope = slope.abs().max(LEAST_SLOPE).copysign(slope);
    // A shift across the line of sight, projected along it into the plane.
    let [a, b] = axes_across(sight).map(|e| (e - sight * (normal.dot(e) / slope)) * sd_m);
    square(a) + square(b)
}

impl Predictor for DeterministicPredictor {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let followed = self.follow(scene, input);
        self.prediction = followed
            .zip(input.hand)
            .and_then(|(followed, hand)| self.contact(scene, hand, followed));
        self.prediction.as_slice()
    }

    fn reset(&mut self) {
        *self = Self {
            config: self.config,
            ..Self::default()
        };
    }
}

impl DeterministicPredictor {
    /// The fixated place, or the last one during saccades.
    fn fixation(&mut self, scene: &Scene, t_s: f64, gaze: &Gaze) -> Option<Aim> {
        match gaze.fixation().filter(|fixation| fixation.is_usable()) {
            Some(&fixation) => {
                let GazeRay {
                    origin_m,
                    direction,
                } = fixation.ray;
                let aim = Self::aimed_at(scene, origin_m, direction).map(|aim| Aim {
                    fixation: Some(fixation),
                    ..aim
                });
                self.held = aim.map(|aim| (aim, t_s));
                aim
            }
            None => {
                // Also false after a clock reset, and for NaN.
                let fresh = |(_, at_s): &(Aim, f64)| (0.0..=HOLD_S).contains(&(t_s - at_s));
                self.held.filter(fresh).map(|(aim, _)| aim)
            }
        }
    }

    /// Processes a sample without predicting; `None` while the hand is lost.
    pub(super) fn follow(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> Option<Followed> {
        let usable = |h: &&HandState| h.point_m.is_finite() && h.velocity_m_per_s.is_finite();
        let looked_at = self.fixation(scene, input.frame.t_s, &input.gaze);
        let hand = input.hand.filter(usable)?;
        let eye_m = looked_at.and_then(|aim| Some(aim.fixation?.ray.origin_m));
        let side = self.side.free_side(scene, hand, eye_m);
        Some(Followed { looked_at, side })
    }

    /// The next contact, from the last processed sample; `None` if there is none.
    pub(super) fn contact(
        &self,
        scene: &Scene,
        hand: &HandState,
        Followed { looked_at, side }: Followed,
    ) -> Option<ContactPrediction> {
        let by_gaze = || self.project(scene, looked_at?, hand, &side, PredictionSource::Gaze);
        // Without gaze, the path of the hand tells what it passed through.
        let through = || {
            let aim = Aim {
                surface: side.behind?.surface,
                point_m: None,
                fixation: None,
            };
            self.project(scene, aim, hand, &side, PredictionSource::HandDirection)
        };
        let by_hand = || {
            let aim = Self::aimed_at(scene, hand.point_m, hand.direction?)?;
            self.project(scene, aim, hand, &side, PredictionSource::HandDirection)
        };
        let by_distance = || {
            let closest = scene.closest_touchable(hand.point_m, NEAREST_M).ok()??;
            let aim = Aim {
                surface: closest.surface,
                point_m: None,
                fixation: None,
            };
            self.project(scene, aim, hand, &side, PredictionSource::Nearest)
        };
        by_gaze()
            .or_else(through)
            .or_else(by_hand)
            .or_else(by_distance)
    }
}

/// Where the line from the eye to the hand enters the surface; `None` if the surface does not lie between them.
fn entry(scene: &Scene, surface: SurfaceId, eye_m: DVec3, hand_m: DVec3) -> Option<Hit> {
    let sight = hand_m - eye_m;
    let hit = scene.ray_cast(eye_m, sight).ok().flatten()?;
    // A hand that lies on the surface, up to rounding, is not behind it.
    let before_hand = hit.distance_m < sight.length() * (1.0 - 1e-9);
    (hit.surface == surface && before_hand).then_some(hit)
}
