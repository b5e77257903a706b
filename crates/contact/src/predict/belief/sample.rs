//! Predictions of every source for the next contact at one time.

use super::super::gaussian::Gaussian;
use super::super::gaze_memory::{Dwell, GazeMemory};
use super::super::hand::phase::ReachPhase;
use super::super::hand::place::{HandPlace, gaussian_of};
use super::super::stream::StreamEstimator;
use super::context::{Context, SourceShares};
use super::gaze_error;
use super::model::EvidenceModel;
use super::places::TouchedPlaces;
use crate::estimate::ContactEstimator;
use crate::matrices::{Plane, axes_across, isotropic, square};
use glam::{DMat3, DVec3};
use hwall_hand::{HandState, WatchConfig};
use std::f64::consts::TAU;

/// Factor on the stated standard deviation of an estimate that is wrong.
const ASTRAY: f64 = 3.0;
/// A fixation this many standard deviations from the predicted end disagrees with the motion.
const DISAGREES: f64 = 4.0;
/// Error of the labelled contacts, in each axis, m: a tracked tip is a point inside the finger.
const LABEL_SD_M: f64 = 0.008;
/// Length of the line of sight on which the contact may lie, m.
const ALONG_M: f64 = 1.2;
/// Least distance of a contact from the eyes, m.
const NEAREST_FIXATION_M: f64 = 0.1;
/// Standard deviation in depth about the surface on the line of sight, m: past an edge, a nearer or farther one may be meant.
const DEPTH_SD_M: f64 = 0.4;

/// Inputs of every source at one time.
#[derive(Debug, Clone, Copy)]
pub(in crate::predict) struct Sample {
    pub(super) context: Context,
    /// Predicted end of the motion as the estimator states it, and the same with the error of a wrong estimate; `None` at rest.
    pub(super) motion: Option<[Gaussian; 2]>,
    /// The present fixation and the one before, without the constant error of the person's gaze.
    pub(super) dwells: [Option<Dwell>; 2],
    /// Position of the resting hand, or its last rest before it moved, m.
    pub(super) rest_m: DVec3,
}

impl Sample {
    /// `default_sd_m`: for an estimate without a covariance.
    pub(super) fn new<E: ContactEstimator>(
        hand: &HandState,
        stream: &StreamEstimator<E>,
        memory: &GazeMemory,
        has_places: bool,
        model: &EvidenceModel,
        (watch, default_sd_m): (&WatchConfig, f64),
    ) -> Option<Self> {
        let estimate = stream.estimate();
        let place = HandPlace::new(hand, stream.began(), stream.drifted_m(), estimate, watch);
        let motion = estimate.and_then(|e| gaussian_of(e, default_sd_m));
        let motion = motion.and_then(|g| Some([g, g.stretched(ASTRAY)?]));
        let (now, before) = memory.dwells(hand.t_s, model.memory_s);
        let corrected = |dwell: &Dwell| {
            let mut dwell = *dwell;
            dwell.ray = gaze_error::without(&dwell.ray, model.gaze_bias_rad);
            dwell
        };
        let (now, before) = (
            now.map(corrected),
            before.map(|(dwell, ago_s)| (corrected(dwell), ago_s)),
        );
        let phase = match motion {
            None if place.phase != ReachPhase::Drifting => ReachPhase::Rest,
            _ => place.phase,
        };
        let cue = now
            .as_ref()
            .zip(motion.as_ref())
            .and_then(|(dwell, [motion, _])| {
                Some((deviations(motion, dwell, model.on_target_sd_rad)? / DISAGREES).min(1.0))
            });
        place.rest_m.is_finite().then(|| Self {
            context: Context {
                phase,
                fixation_age_s: now.as_ref().map(|dwell| dwell.age_s(hand.t_s)),
                before_left: before
                    .as_ref()
                    .map_or(0.0, |(_, ago_s)| 1.0 - ago_s / model.memory_s),
                has_places,
                cue,
            },
            motion,
            dwells: [now, before.map(|(dwell, _)| dwell)],
            rest_m: place.rest_m,
        })
    }

    /// Contact by a fixation: on its line, at the distance given by the motion, or at the surface it meets.
    pub(super) fn along(
        &self,
        dwell: &Dwell,
        sd_rad: f64,
        distance_m: Option<f64>,
    ) -> Option<Gaussian> {
        let (origin_m, sight) = (dwell.ray.origin_m, dwell.ray.direction);
        let sd_rad = sd_rad.hypot(dwell.noise_rad);
        let across = DMat3::IDENTITY - square(sight);
        let by_motion = self.motion.as_ref();
        if let Some(gaussian) = by_motion.and_then(|[_, astray]| on_sight(astray, dwell, sd_rad)) {
            return Some(gaussian);
        }
        let distance_m = distance_m?.max(NEAREST_FIXATION_M);
        let sd_m = sd_rad * distance_m;
        let covariance_m2 = square(sight) * (DEPTH_SD_M * DEPTH_SD_M) + across * (sd_m * sd_m);
        Gaussian::new(origin_m + sight * distance_m, covariance_m2)
    }

    /// The end of the motion, with the learned error of the estimator.
    pub(super) fn end(&self, model: &EvidenceModel) -> Option<Gaussian> {
        let [motion, _] = self.motion.as_ref()?;
        motion.stretched(model.motion_scale[self.context.phase as usize])
    }

    /// The motion's end combined with the line of the present fixation.
    pub(super) fn confirmed(&self, model: &EvidenceModel) -> Option<Gaussian> {
        let (end, dwell) = (self.end(model)?, self.dwells[0]?);
        let sd_rad = model.on_target_sd_rad.hypot(dwell.noise_rad);
        on_sight(&end, &dwell, sd_rad)
    }

    /// Contact if no other source is right.
    pub(super) fn anywhere(&self, model: &EvidenceModel) -> Option<Gaussian> {
        match self.motion {
            Some([_, astray]) => Some(astray),
            None => model.rest.about(self.rest_m),
        }
    }

    /// Log density of a contact by each source, per m³.
    pub(super) fn log_densities(
        &self,
        contact_m: DVec3,
        places: &TouchedPlaces,
        model: &EvidenceModel,
    ) -> SourceShares {
        let by = |g: Option<Gaussian>| {
            let g = g.and_then(|g| g.widened(isotropic(LABEL_SD_M)));
            g.map_or(f64::NEG_INFINITY, |g| g.log_density(contact_m))
        };
        let dwell = |i: usize| {
            self.dwells[i].map_or(f64::NEG_INFINITY, |dwell| {
                match self.along(&dwell, model.on_target_sd_rad, None) {
                    Some(along) => by(Some(along)),
                    None => log_along_sight(&dwell, contact_m, model.on_target_sd_rad),
                }
            })
        };
        [
            by(self.end(model)),
            by(self.confirmed(model)),
            dwell(0),
            dwell(1),
            places.log_density(contact_m, self.motion.as_ref().map(|[_, astray]| astray)),
            by(self.anywhere(model)),
        ]
    }

    /// Posterior probability of each source given the contact; `None` if no source expects it.
    pub(super) fn responsibilities(
        &self,
        shares: &SourceShares,
        log_densities: &SourceShares,
    ) -> Option<SourceShares> {
        let logs: SourceShares = std::array::from_fn(|i| shares[i].ln() + log_densities[i]);
        let most = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logs.iter().map(|log| (log - most).exp()).sum();
        sum.is_finite()
            .then(|| logs.map(|log| (log - most).exp() / sum))
    }
}

/// Product of a Gaussian and that about a line of sight.
fn on_sight(gaussian: &Gaussian, dwell: &Dwell, sd_rad: f64) -> Option<Gaussian> {
    let (origin_m, sight) = (dwell.ray.origin_m, dwell.ray.direction);
    let sd_m = sd_rad * (gaussian.mean_m - origin_m).dot(sight);
    let across = DMat3::IDENTITY - square(sight);
    let is_ahead = sd_m > sd_rad * NEAREST_FIXATION_M;
    is_ahead.then(|| gaussian.times(origin_m, across * (1.0 / (sd_m * sd_m))))?
}

/// Distance of a fixation from the predicted end, in standard deviations per axis; [`DISAGREES`] for eyes that look away, `None` if it cannot be
/// computed.
fn deviations(motion: &Gaussian, dwell: &Dwell, sd_rad: f64) -> Option<f64> {
    let sight = dwell.ray.direction;
    let to_mean = motion.mean_m - dwell.ray.origin_m;
    let distance_m = to_mean.dot(sight);
    if distance_m < NEAREST_FIXATION_M {
        return Some(DISAGREES);
    }
    let axes = axes_across(sight);
    let sd_m = distance_m * sd_rad.hypot(dwell.noise_rad);
    let spread = Plane::of(&motion.covariance_m2, axes).plus(sd_m * sd_m);
    let squared = spread.squared(axes.map(|axis| to_mean.dot(axis)));
    (squared >= 0.0).then(|| (0.5 * squared).sqrt())
}

/// Log density of a contact on a line of sight at unknown distance, per m³.
fn log_along_sight(dwell: &Dwell, contact_m: DVec3, sd_rad: f64) -> f64 {
    let to_contact = contact_m - dwell.ray.origin_m;
    let rad = dwell.ray.direction.angle_between(to_contact);
    let variance = sd_rad * sd_rad + dwell.noise_rad * dwell.noise_rad;
    let square_m2 = to_contact
        .length_squared()
        .max(NEAREST_FIXATION_M * NEAREST_FIXATION_M);
    -0.5 * rad * rad / variance - (TAU * variance * ALONG_M * square_m2).ln()
}
