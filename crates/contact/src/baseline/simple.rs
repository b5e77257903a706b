//! The hand stops immediately, or keeps its velocity.

use super::durations::Durations;
use super::hand_path::PathTracker;
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use crate::reach_set::references;
use hwall_hand::{HandFrame, LabelledReach};
use std::borrow::Borrow;

/// The hand stays where it is: the touching point ends at its last position.
///
/// The time left is the mean over the training reaches that lasted longer than this one so far.
#[derive(Debug, Clone)]
pub struct Hold {
    tracker: PathTracker,
    durations: Durations,
}

impl Hold {
    /// Learns which point touches, its offset from the others, and how long reaches last.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train<R: Borrow<LabelledReach>>(reaches: &[R]) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
        Ok(Self {
            tracker: PathTracker::train(reaches)?,
            durations: Durations::of(reaches),
        })
    }
}

impl ContactEstimator for Hold {
    fn begin(&mut self) {
        self.tracker.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let durations = &self.durations;
        self.tracker.step(frame, |path| ContactEstimate {
            time_to_contact_s: Some(durations.left(path.elapsed_s())),
            ..ContactEstimate::of_point(path.now_s(), path.now_m())
        })
    }
}

/// The hand keeps its velocity and stops when the predicted time is over.
///
/// Velocity: the slope of the straight line through the last 0.06 s. Arrival: the mean duration of the training reaches that lasted longer than
/// this one so far; trained on one reach, exactly its duration. Past that time, the prediction is the present position.
#[derive(Debug, Clone)]
pub struct ConstantVelocity {
    tracker: PathTracker,
    durations: Durations,
}

impl ConstantVelocity {
    /// Learns which point touches, its offset from the others, and how long reaches last.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train<R: Borrow<LabelledReach>>(reaches: &[R]) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
        Ok(Self {
            tracker: PathTracker::train(reaches)?,
            durations: Durations::of(reaches),
        })
    }
}

impl ContactEstimator for ConstantVelocity {
    fn begin(&mut self) {
        self.tracker.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let durations = &self.durations;
        self.tracker.step(frame, |path| {
            let left = durations.left(path.elapsed_s());
            let end_m = path.now_m() + left.mean_s * path.velocity_m_per_s();
            ContactEstimate {
                time_to_contact_s: Some(left),
                ..ContactEstimate::of_point(path.now_s(), end_m)
            }
        })
    }
}
