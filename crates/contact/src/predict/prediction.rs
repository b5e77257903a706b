//! Predictions of contact in a scene, and the trait of all predictors.

use crate::estimate::TimeToContact;
use crate::matrices::{Plane, axes_across};
use glam::{DMat3, DVec3};
use hwall_hand::{Gaze, HandFrame, HandState, Pose};
use hwall_scene::{Scene, SurfaceId};

/// Input of a predictor at one time: a sample and the filter outputs, all in the frame of the scene.
#[derive(Debug, Clone, Copy)]
pub struct PredictorInput<'a> {
    /// The sample as the tracker gave it.
    pub frame: &'a HandFrame,
    /// The hand, filtered; `None` while it is lost.
    pub hand: Option<&'a HandState>,
    /// The gaze, filtered: a fixation and its start, a saccade, or lost.
    pub gaze: Gaze,
}

/// A possible next contact, in the frame of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPrediction {
    /// The surface.
    pub surface: SurfaceId,
    /// Expected contact point, m, given that this surface is touched.
    pub point_m: DVec3,
    /// Covariance of the error of `point_m`, given that this surface is touched, symmetric, m²; `None` if the predictor states none.
    pub covariance_m2: Option<DMat3>,
    /// Unit normal of the surface there, on the person's side.
    pub normal: DVec3,
    /// Roughness level of the surface, on the scale of the scene, if it has one.
    pub roughness: Option<f64>,
    /// Distance of the hand from the surface, m; negative, along the normal, for a hand already behind the surface.
    pub distance_m: f64,
    /// Time until the hand is there, s: 0 for a hand behind the surface, `None` for one that does not approach.
    pub time_to_contact_s: Option<TimeToContact>,
    /// Probability of this place; the probabilities sum to 1 over all predictions of a sample. The probability of a surface is the sum over its
    /// places.
    pub probability: f64,
    /// How the surface was found.
    pub source: PredictionSource,
    /// Start of the fixation on the predicted place, s; `None` if it is not fixated.
    pub looked_at_since_s: Option<f64>,
}

impl ContactPrediction {
    /// A single place with probability 1, found by the hand's motion, at distance 0 from the hand; without covariance, time, roughness or fixation.
    /// Fill in the rest if known.
    #[must_use]
    pub const fn of_place(surface: SurfaceId, point_m: DVec3, normal: DVec3) -> Self {
        Self {
            surface,
            point_m,
            covariance_m2: None,
            normal,
            roughness: None,
            distance_m: 0.0,
            time_to_contact_s: None,
            probability: 1.0,
            source: PredictionSource::Motion,
            looked_at_since_s: None,
        }
    }

    /// The same contact in another frame.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        let r = a_from_b.rotation();
        Self {
            point_m: a_from_b.transform_point(self.point_m),
            normal: a_from_b.transform_vector(self.normal),
            covariance_m2: self.covariance_m2.map(|c| r * c * r.transpose()),
            ..*self
        }
    }

    /// Squared Mahalanobis distance of a point of the surface from the predicted one, in the plane of the surface; `None` without a covariance.
    /// Compare it with [`region_squared`](Self::region_squared).
    #[must_use]
    pub fn squared_deviations(&self, point_m: DVec3) -> Option<f64> {
        let axes = axes_across(self.normal);
        let covariance_m2 = Plane::of(&self.covariance_m2?, axes);
        let off_m = point_m - self.point_m;
        Some(covariance_m2.squared(axes.map(|axis| off_m.dot(axis))))
    }

    /// Squared deviations of the region that contains the contact with this probability, 0 to below 1. Exact for normal errors; the errors of
    /// predictions have heavier tails, so regions of 50 and 70 % contain more contacts than stated.
    #[must_use]
    pub fn region_squared(probability: f64) -> f64 {
        -2.0 * (1.0 - probability).ln()
    }
}

/// How a predicted surface was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PredictionSource {
    /// The gaze ray meets it.
    Gaze,
    /// The ray from the hand along its direction of motion meets it.
    HandDirection,
    /// The closest touchable surface.
    Nearest,
    /// The estimated end of the hand's motion, combined with gaze.
    Motion,
    /// A place this person has touched before. A surface may then be listed twice: with this place, and with the one from the rest of the evidence.
    TouchedBefore,
}

/// Predicts contact from a scene, a tracked hand and, if available, gaze.
///
/// Samples come in order of time, including those without the hand. The scene may change between samples, e.g. a door moves.
pub trait Predictor {
    /// Predicts the next contact, the most probable place first; empty if there is none. All numbers are finite.
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction];

    /// Joint angles of the arm's response to the last sample, rad, from a predictor that learned them: the arm goes there instead of to the
    /// predicted contact. The default, `None`, is for predictors without an arm model.
    fn response_rad(&self) -> Option<[f64; 7]> {
        None
    }

    /// Does the predictor withhold its answer because the motion is unlike its training data? The default, `false`, is for predictors without that
    /// test.
    fn is_unfamiliar(&self) -> bool {
        false
    }

    /// The touching point made contact at `contact_m`, m, at `contact_s`, s, on the clock of the samples; adaptive predictors learn from it. The
    /// default does nothing.
    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let _ = (contact_m, contact_s);
    }

    /// Forgets the samples so far, e.g. for another person or a scene that jumped. The trained model stays; adaptation from
    /// [`touched`](Self::touched) is lost.
    fn reset(&mut self) {}
}

impl<P: Predictor + ?Sized> Predictor for Box<P> {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        (**self).predict(scene, input)
    }

    fn response_rad(&self) -> Option<[f64; 7]> {
        (**self).response_rad()
    }

    fn is_unfamiliar(&self) -> bool {
        (**self).is_unfamiliar()
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        (**self).touched(contact_m, contact_s);
    }

    fn reset(&mut self) {
        (**self).reset();
    }
}
