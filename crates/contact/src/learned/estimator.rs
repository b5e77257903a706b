//! Estimates of a reach from what was learnt.

use super::config::Combination;
use super::gates::Gates;
use super::held_out_errors::HeldOut;
use super::local_ridge::LocalRidge;
use super::primitive::{Primitive, PrimitiveRun};
use super::reach_track::{Inputs, ReachTrack};
use super::training::OUTPUTS;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use glam::DVec3;
use hwall_hand::HandFrame;
use std::sync::Arc;

/// Longest time without any point of the hand that is bridged, s.
const LONGEST_GAP_S: f64 = 0.1;

/// All that was learnt; shared between estimators.
#[derive(Debug)]
pub(super) struct Learnt {
    pub(super) origin: Origin,
    pub(super) inputs: Inputs,
    pub(super) gates: Gates,
    pub(super) ridge: LocalRidge,
    pub(super) primitive: Option<Primitive>,
    pub(super) errors: HeldOut,
    pub(super) combination: Combination,
}

/// What a model was learnt from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Origin {
    pub(super) reaches: usize,
    pub(super) people: usize,
    pub(super) median_duration_s: f64,
}

/// Follows a reach with a [`LearnedModel`](super::LearnedModel). A step does not allocate after the first of a reach;
/// [`begin`](ContactEstimator::begin) does.
///
/// While the touching point is missing, another point of the hand stands in; while none is seen at all, the
/// last estimate is repeated for up to 0.1 s, with less and less time to contact.
#[derive(Debug, Clone)]
pub struct LearnedEstimator {
    learnt: Arc<Learnt>,
    track: ReachTrack,
    run: Option<PrimitiveRun>,
    features: Vec<f64>,
    gates: Vec<f64>,
    last: Option<ContactEstimate>,
}

impl ContactEstimator for LearnedEstimator {
    fn training_reaches(&self) -> Option<usize> {
        Some(self.learnt.origin.reaches)
    }

    fn begin(&mut self) {
        self.last = None;
        self.track.begin();
        if let Some(run) = &mut self.run {
            run.begin();
        }
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        if !self.track.push(frame) {
            return self.unseen(frame.t_s);
        }
        self.last = self.seen();
        self.last
    }
}

impl LearnedEstimator {
    pub(super) fn new(learnt: &Arc<Learnt>) -> Self {
        Self {
            track: ReachTrack::new(&learnt.inputs),
            run: learnt.primitive.as_ref().map(PrimitiveRun::new),
            features: Vec::with_capacity(learnt.inputs.widths()[0]),
            gates: Vec::with_capacity(learnt.gates.len()),
            last: None,
            learnt: Arc::clone(learnt),
        }
    }

    /// The last estimate, for a time at which nothing was seen.
    fn unseen(&self, t_s: f64) -> Option<ContactEstimate> {
        let last = self.last?;
        let waited_s = t_s - last.t_s;
        (waited_s > 0.0 && waited_s <= LONGEST_GAP_S).then(|| ContactEstimate {
            t_s,
            time_to_contact_s: last.time_to_contact_s.map(|time| TimeToContact {
                mean_s: (time.mean_s - waited_s).max(0.0),
                ..time
            }),
            ..last
        })
    }

    /// The estimate of the latest sample of the track.
    fn seen(&mut self) -> Option<ContactEstimate> {
        let (t_s, now_m) = self.track.now()?;
        let (_, start_m) = self.track.start()?;
        let primitive_m = self.run.as_mut().and_then(|run| {
            run.step(&self.learnt.inputs, &self.track).ok()?;
            run.end().ok()?
        });
        let learnt = &*self.learnt;
        self.track.features_into(&learnt.inputs, &mut self.features);
        learnt
            .gates
            .weights_into(&self.track.progress(), &mut self.gates);
        let mut out = [0.0; OUTPUTS];
        let out = &mut out[..learnt.ridge.outputs()];
        learnt.ridge.predict(&mut self.features, &self.gates, out);
        let regression_m = now_m + DVec3::from_slice(&out[..3]);
        let errors = learnt.errors.at(&self.gates);
        let combined = learnt.errors.estimate(
            &errors,
            learnt.combination,
            start_m,
            regression_m,
            primitive_m,
        );
        let normal = (out.len() == OUTPUTS).then(|| DVec3::from_slice(&out[4..7]));
        let estimate = ContactEstimate {
            t_s,
            point_m: combined.point_m,
            covariance_m2: Some(combined.moments_m2),
            normal: normal.and_then(DVec3::try_normalize),
            time_to_contact_s: Some(TimeToContact {
                mean_s: out[3].max(0.0),
                sd_s: Some(errors.time_sd_s()),
            }),
        };
        estimate.is_finite().then_some(estimate)
    }
}
