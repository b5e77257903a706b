//! The response as a predictor of contacts.

use super::estimator::ResponseEstimator;
use super::filter::JointPosterior;
use super::model::ResponseModel;
use crate::error::SessionError;
use glam::DVec3;
use hwall_contact::{
    ContactEstimate, ContactPrediction, Predictor, PredictorInput, StreamEstimator,
};
use hwall_hand::WatchConfig;
use hwall_kinematics::ArmKinematics;
use hwall_scene::Scene;
use std::sync::Arc;

/// A hand that rests within this distance of the presented board counts as being at the board, m.
const AT_IT_M: f64 = 0.12;
/// A face within this distance of a surface represents that surface, m. Point and normal of the prediction come from the face, not from the
/// surface.
const STANDS_FOR_M: f64 = 0.3;

/// Hysteresis: after being outside the joint limits, a response must be inside by this much to count again, rad.
const INSIDE_RAD: f64 = 0.03;

/// What an [`EndToEnd`] predictor does with the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ResponseState {
    /// No reach is under way.
    #[default]
    Idle,
    /// The arm follows the response.
    Answering,
    /// The arm waits: the reach is unlike the training reaches.
    Unfamiliar,
    /// The arm waits: the response is outside the joint limits.
    BeyondLimits,
}

/// Leads the arm by the posterior over its joints; see [`Predictor::response_rad`].
///
/// For the policy it predicts a contact at the face of the board by forward kinematics, with the covariance of the posterior, so an
/// uncertain response does not move the arm.
#[derive(Debug, Clone)]
pub struct EndToEnd {
    stream: StreamEstimator<ResponseEstimator>,
    /// Newest result of the current reach, or of the one that ended at the board.
    newest: Option<(ContactEstimate, JointPosterior)>,
    hand_m: Option<DVec3>,
    answer: Option<ContactPrediction>,
    state: ResponseState,
}

impl EndToEnd {
    /// For the arm that was demonstrated, with the face of the board as its tool.
    ///
    /// # Errors
    /// None with the built-in settings.
    pub fn new(model: &ResponseModel, arm: Arc<dyn ArmKinematics>) -> Result<Self, SessionError> {
        let estimator = ResponseEstimator::new(model, arm);
        Ok(Self {
            stream: StreamEstimator::new(estimator, WatchConfig::default())?,
            newest: None,
            hand_m: None,
            answer: None,
            state: ResponseState::Idle,
        })
    }

    /// What it does with the hand.
    #[must_use]
    pub const fn state(&self) -> ResponseState {
        self.state
    }

    /// What to do with a posterior, given the state before it.
    fn state_with(&self, posterior: &JointPosterior) -> ResponseState {
        let estimator = self.stream.estimator();
        if !estimator.is_familiar() {
            return ResponseState::Unfamiliar;
        }
        let inside_rad = match self.state {
            ResponseState::BeyondLimits => INSIDE_RAD,
            _ => 0.0,
        };
        let limits = estimator.arm().limits();
        let is_inside = (limits.iter().zip(&posterior.q.0)).all(|(limit, q_rad)| {
            limit.contains(q_rad - inside_rad) && limit.contains(q_rad + inside_rad)
        });
        match is_inside {
            true => ResponseState::Answering,
            false => ResponseState::BeyondLimits,
        }
    }

    /// The posterior that the last prediction was made from; `None` without one.
    #[must_use]
    pub fn posterior(&self) -> Option<&JointPosterior> {
        self.answer.as_ref()?;
        self.newest.as_ref().map(|(_, posterior)| posterior)
    }
}

impl Predictor for EndToEnd {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let estimate = self.stream.step(input.frame, input.hand);
        self.hand_m = input.hand.map(|hand| hand.point_m).or(self.hand_m);
        match estimate.zip(self.stream.estimator().posterior().copied()) {
            Some(newest) => {
                self.state = self.state_with(&newest.1);
                let answers = self.state == ResponseState::Answering;
                self.newest = answers.then_some(newest);
            }
            None => {
                let hand_m = self.hand_m;
                let is_there = |point_m: DVec3| {
                    hand_m.is_some_and(|hand_m| hand_m.distance(point_m) <= AT_IT_M)
                };
                self.newest = self.newest.filter(|(e, _)| is_there(e.point_m));
                self.state = match self.newest {
                    Some(_) => ResponseState::Answering,
                    None => ResponseState::Idle,
                };
            }
        }
        self.answer = self.newest.and_then(|(estimate, _)| {
            let surface = scene.closest_touchable(estimate.point_m, STANDS_FOR_M);
            let surface = surface.ok().flatten()?.surface;
            let normal = estimate.normal?;
            let from_hand = self.hand_m? - estimate.point_m;
            Some(ContactPrediction {
                covariance_m2: estimate.covariance_m2,
                roughness: scene.surface(surface).roughness,
                distance_m: from_hand.dot(normal),
                time_to_contact_s: estimate.time_to_contact_s,
                ..ContactPrediction::of_place(surface, estimate.point_m, normal)
            })
        });
        self.answer.as_slice()
    }

    fn response_rad(&self) -> Option<[f64; 7]> {
        self.posterior().map(|posterior| posterior.q.0)
    }

    fn is_unfamiliar(&self) -> bool {
        self.state == ResponseState::Unfamiliar
    }

    fn reset(&mut self) {
        self.stream.reset();
        self.state = ResponseState::Idle;
        (self.newest, self.hand_m, self.answer) = (None, None, None);
    }
}
