//! Prediction by one ray, as in the dissertation.

use super::prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
use crate::error::ContactError;
use crate::estimate::TimeToContact;
use glam::DVec3;
use hwall_hand::{GazeRay, HandState};
use hwall_numeric::check::positive;
use hwall_scene::{Hit, Scene, SurfaceId};

/// Limits of the deterministic predictor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeterministicConfig {
    /// Surfaces further than this from the hand are not about to be touched, m. Default 1.5: an arm's
    /// length and a step. Looking at a far wall then does not hide the panel under the hand.
    pub max_distance_m: f64,
    /// How far the closest touchable surface, the last resort, may be from the hand, m. Default 0.3.
    pub nearest_radius_m: f64,
    /// A hand that approaches more slowly than this does not approach, m/s. Default 0.02: the noise of a
    /// resting hand.
    pub min_closing_speed_m_per_s: f64,
    /// Lets the ray that found the surface lead the point while the hand is far. Default `None`: the
    /// point is always the projection of the hand, as in the dissertation.
    pub ray_lead: Option<RayLead>,
}

/// How far from the surface the ray leads the predicted point.
///
/// Beyond `far_m` the point is where the ray that found the surface (gaze, or direction of motion) meets
/// it. Within `near_m` it is where the hand's own motion leads, or the hand's projection if it does not
/// approach. In between it is a mixture in proportion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayLead {
    /// Distance of the hand up to which its own motion decides, m.
    pub near_m: f64,
    /// Distance of the hand from which the ray decides, m; larger than `near_m`.
    pub far_m: f64,
}

impl Default for DeterministicConfig {
    fn default() -> Self {
        Self {
            max_distance_m: 1.5,
            nearest_radius_m: 0.3,
            min_closing_speed_m_per_s: 0.02,
            ray_lead: None,
        }
    }
}

impl DeterministicConfig {
    /// The ray leads while the hand is more than 0.06 m away, and counts for nothing below 0.02 m.
    ///
    /// A person looks at the place before the hand gets there, so an arm that is slower than the
    /// hand gains the time of the reach. The hand's own way there is curved and becomes the better
    /// guide only at the very end: with the ray leading until 0.25 m instead, a simulated iiwa
    /// was in place at half as many touches.
    #[must_use]
    pub fn ray_led() -> Self {
        Self {
            ray_lead: Some(RayLead {
                near_m: 0.02,
                far_m: 0.06,
            }),
            ..Self::default()
        }
    }
}

/// The predictor of the dissertation (section III.C): the gaze ray finds the surface, the hand
/// projected on it gives point and normal, its velocity the time.
///
/// Without a gaze, or when it meets nothing that can be touched within reach, the ray along the
/// hand's direction of motion finds the surface, else the closest touchable surface is taken;
/// [`ContactPrediction::source`] says which. By default the point is the projection of the hand in
/// every case, so a change of source within one surface does not make the board leap;
/// [`DeterministicConfig::ray_led`] trades that for earlier points.
///
/// Known failures, kept as tests: if the gaze meets another object in front of the one that is meant, the
/// other one is predicted; near a corner the prediction changes wall as soon as the gaze does; a hand that
/// approaches at a slant touches beside its projection, the more so the further away it is; without a
/// gaze, a hand that has passed through a wall seems to stand behind it.
///
/// It names one surface, with probability 1 and no covariance: it does not know how certain it is.
#[derive(Debug, Clone, Default)]
pub struct DeterministicPredictor {
    config: DeterministicConfig,
    prediction: Option<ContactPrediction>,
}

impl DeterministicPredictor {
    /// A predictor with these limits.
    ///
    /// # Errors
    /// A limit that is not positive and finite.
    pub fn new(config: DeterministicConfig) -> Result<Self, ContactError> {
        positive("max_distance_m", config.max_distance_m)?;
        positive("nearest_radius_m", config.nearest_radius_m)?;
        positive(
            "min_closing_speed_m_per_s",
            config.min_closing_speed_m_per_s,
        )?;
        if let Some(RayLead { near_m, far_m }) = config.ray_lead {
            positive("near_m", near_m)?;
            positive("far_m - near_m", far_m - near_m)?;
        }
        Ok(Self {
            config,
            prediction: None,
        })
    }

    /// Where a ray meets the scene first, if what it meets first is touchable.
    fn aimed_at(scene: &Scene, origin_m: DVec3, direction: DVec3) -> Option<Aim> {
        // The scene refuses only rays that are not finite or have no direction: nothing is aimed at.
        let hit = scene.ray_cast(origin_m, direction).ok().flatten()?;
        let aim = Aim {
            surface: hit.surface,
            point_m: Some(hit.point_m),
        };
        scene.surface(hit.surface).touchable().then_some(aim)
    }

    /// The hand projected on a surface, or led there by the ray, unless that is out of reach.
    fn project(
        &self,
        scene: &Scene,
        Aim {
            surface,
            point_m: aimed_m,
        }: Aim,
        hand: &HandState,
        gaze: Option<&GazeRay>,
        source: PredictionSource,
    ) -> Option<ContactPrediction> {
        let hand_m = hand.point_m;
        let behind = gaze.and_then(|gaze| entry(scene, surface, gaze.origin_m, hand_m));
        let (point_m, normal, distance_m) = match behind {
            Some(Hit {
                point_m: face_m,
                normal,
                ..
            }) => {
                // Onto the face through which the hand went: a thick wall also has a back.
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
        let time_to_contact_s = if behind.is_some() || distance_m == 0.0 {
            Some(0.0)
        } else {
            let closing = hand.velocity_m_per_s.dot(point_m - hand_m) / distance_m;
            (closing >= self.config.min_closing_speed_m_per_s).then(|| distance_m / closing)
        };
        let (point_m, normal) = match self.config.ray_lead {
            Some(RayLead { near_m, far_m }) if distance_m > 0.0 => {
                let ahead_m = self
                    .ahead(scene, surface, hand, time_to_contact_s)
                    .unwrap_or(point_m);
                let share = ((distance_m - near_m) / (far_m - near_m)).clamp(0.0, 1.0);
                let led = scene
                    .project_on(surface, ahead_m.lerp(aimed_m.unwrap_or(ahead_m), share))
                    .ok()?;
                // The normal on the hand's side, from whichever side the point was met.
                let facing = if led.normal.dot(normal) < 0.0 {
                    -led.normal
                } else {
                    led.normal
                };
                (led.point_m, facing)
            }
            _ => (point_m, normal),
        };
        Some(ContactPrediction {
            surface,
            point_m,
            covariance_m2: None,
            normal,
            roughness: scene.surface(surface).roughness,
            distance_m,
            time_to_contact_s: time_to_contact_s.map(|mean_s| TimeToContact { mean_s, sd_s: None }),
            probability: 1.0,
            source,
        })
    }
}

impl DeterministicPredictor {
    /// Where a hand that clearly approaches a surface would meet it on its way.
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

/// The direction of motion counts this long before contact, s; earlier the hand still turns.
const AHEAD_S: f64 = 0.4;

/// A surface, and where the ray that found it meets it.
#[derive(Clone, Copy)]
struct Aim {
    surface: SurfaceId,
    point_m: Option<DVec3>,
}

impl Predictor for DeterministicPredictor {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.prediction = input
            .hand
            .and_then(|hand| self.contact(scene, hand, input.gaze.ray()));
        self.prediction.as_slice()
    }
}

impl DeterministicPredictor {
    /// The contact that comes next; `None` when none is in sight.
    fn contact(
        &self,
        scene: &Scene,
        hand: &HandState,
        gaze: Option<&GazeRay>,
    ) -> Option<ContactPrediction> {
        if !(hand.point_m.is_finite() && hand.velocity_m_per_s.is_finite()) {
            return None;
        }
        let by_gaze = || {
            let ray = gaze?;
            let aim = Self::aimed_at(scene, ray.origin_m, ray.direction)?;
            self.project(scene, aim, hand, gaze, PredictionSource::Gaze)
        };
        let by_hand = || {
            let aim = Self::aimed_at(scene, hand.point_m, hand.direction?)?;
            self.project(scene, aim, hand, gaze, PredictionSource::HandDirection)
        };
        let by_distance = || {
            let closest = scene
                .closest_touchable(hand.point_m, self.config.nearest_radius_m)
                .ok()??;
            let aim = Aim {
                surface: closest.surface,
                point_m: None,
            };
            self.project(scene, aim, hand, gaze, PredictionSource::Nearest)
        };
        by_gaze().or_else(by_hand).or_else(by_distance)
    }
}

/// Where the line from the eye to the hand goes through the surface; `None` when the surface does not lie
/// between the two.
fn entry(scene: &Scene, surface: SurfaceId, eye_m: DVec3, hand_m: DVec3) -> Option<Hit> {
    let sight = hand_m - eye_m;
    let hit = scene.ray_cast(eye_m, sight).ok().flatten()?;
    // A hand that lies on the surface, to rounding, is not behind it.
    let before_hand = hit.distance_m < sight.length() * (1.0 - 1e-9);
    (hit.surface == surface && before_hand).then_some(hit)
}
