//! Predictions of contact in a scene, and the trait of all predictors.

use super::regions::RegionSizes;
use crate::estimate::TimeToContact;
use crate::matrices::{Plane, axes_across};
use glam::{DMat3, DVec3};
use hwall_hand::{Gaze, HandFrame, HandState};
use hwall_scene::{Scene, SurfaceId};

/// What a predictor is given at one time: a sample and what the filters made of it, all in the frame of the
/// scene.
#[derive(Debug, Clone, Copy)]
pub struct PredictorInput<'a> {
    /// The sample as the tracker gave it.
    pub frame: &'a HandFrame,
    /// The hand, filtered; `None` while it is lost.
    pub hand: Option<&'a HandState>,
    /// The gaze, filtered: where it rests and since when, in flight, or lost.
    pub gaze: Gaze,
}

/// Where and when the hand may be about to touch, in the frame of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPrediction {
    /// The surface.
    pub surface: SurfaceId,
    /// The expected point on it, m, if it is this surface.
    pub point_m: DVec3,
    /// Covariance of the error of `point_m`, if it is this surface, symmetric, m²; `None` from a
    /// predictor that has none.
    pub covariance_m2: Option<DMat3>,
    /// How large the regions of 50, 70 and 90 % are, in standard deviations of this covariance: those of a normal distribution
    /// from a predictor that has not learnt them.
    pub regions: RegionSizes,
    /// Unit normal of the surface there, on the person's side.
    pub normal: DVec3,
    /// Roughness level of the surface, on the scale of the scene, where it has one.
    pub roughness: Option<f64>,
    /// Distance of the hand from the surface, m; negative for a hand that is already behind the
    /// surface, then along the normal.
    pub distance_m: f64,
    /// Time until the hand is there, s: 0 for a hand behind the surface, `None` for one that does
    /// not approach.
    pub time_to_contact_s: Option<TimeToContact>,
    /// Probability of this place; those of all predictions of a sample add up to 1. That of a surface is the sum over those that name
    /// it.
    pub probability: f64,
    /// What the surface was found by.
    pub source: PredictionSource,
    /// Since when the eyes have rested on the predicted place, s; `None` if they do not.
    pub looked_at_since_s: Option<f64>,
}

impl ContactPrediction {
    /// One place, for certain, with the hand there: without covariance, time, roughness or look, found by the hand's motion. A
    /// predictor that knows more fills in the rest.
    #[must_use]
    pub const fn of_place(surface: SurfaceId, point_m: DVec3, normal: DVec3) -> Self {
        Self {
            surface,
            point_m,
            covariance_m2: None,
            regions: RegionSizes::NORMAL,
            normal,
            roughness: None,
            distance_m: 0.0,
            time_to_contact_s: None,
            probability: 1.0,
            source: PredictionSource::Motion,
            looked_at_since_s: None,
        }
    }

    /// Squared distance of a point of the surface from the predicted one in standard deviations, in the plane of the surface; `None`
    /// without a covariance. Within [`regions`](Self::regions) it is to be compared with them.
    #[must_use]
    pub fn squared_deviations(&self, point_m: DVec3) -> Option<f64> {
        let axes = axes_across(self.normal);
        let covariance_m2 = Plane::of(&self.covariance_m2?, axes);
        let off_m = point_m - self.point_m;
        Some(covariance_m2.squared(axes.map(|axis| off_m.dot(axis))))
    }
}

/// What a predicted surface was found by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PredictionSource {
    /// The gaze ray meets it.
    Gaze,
    /// The ray from the hand along its direction of motion meets it.
    HandDirection,
    /// It is the closest touchable surface.
    Nearest,
    /// An estimate of where the hand's motion ends, combined with the gaze.
    Motion,
    /// This person has touched the place before. A surface may then be named twice: with this place, and with the one that the rest
    /// of the evidence speaks for.
    TouchedBefore,
}

/// Predicts contact from a scene, a tracked hand and, where there is one, a gaze.
///
/// Samples come in order of time, including those in which the hand is lost. The scene may change from
/// sample to sample, since doors move.
pub trait Predictor {
    /// Predicts the contact that comes next, the most probable place first; empty when no contact is in
    /// sight. All numbers are finite.
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction];

    /// Joint angles with which an arm shall answer the last sample, rad, from a predictor that learnt them: the arm goes
    /// there, and not to where the predicted contact is. `None`, as the default, from one that knows no arm.
    fn response_rad(&self) -> Option<[f64; 7]> {
        None
    }

    /// Does the predictor hold its answer back because the motion is unlike all it learnt from? `false`, as the default, from one
    /// that does not test for it.
    fn is_unfamiliar(&self) -> bool {
        false
    }

    /// The hand has touched there, m, with the point that touches, then, s, on the clock of the samples: predictors
    /// that adapt learn from it. Others do nothing, as the default does.
    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let _ = (contact_m, contact_s);
    }

    /// Forgets the samples so far, for another person or a scene that leapt to another place; what was learnt stays, except
    /// from [`touched`](Self::touched).
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
