//! Estimates for a running reach by a learned model.

use super::blend::adaptation::{Adaptation, Pending};
use super::blend::combination::{Blend, Region, combine, placed};
use super::blend::habit::WayLeft;
use super::blend::knots::{between_knots, time_key};
use super::blend::places::Places;
use super::blend::sources::{Ends, SOURCES, Source, of_combination};
use super::config::{Combination, Frame};
use super::primitive::hand_primitive::{Primitive, PrimitiveRun};
use super::reaches::reach_track::{Cue, Inputs, ReachTrack};
use super::regression::correction::Correction;
use super::regression::gates::Gates;
use super::regression::local_ridge::LocalRidge;
use super::regression::training::OUTPUTS;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use glam::DVec3;
use hwall_hand::HandFrame;
use std::sync::Arc;

/// Longest gap without any point of the hand that is bridged, s.
const LONGEST_GAP_S: f64 = 0.1;

/// Time without a required input until the smaller model takes over, s.
const WAITED_S: f64 = 0.1;

/// The learned parameters, shared between estimators.
#[derive(Debug)]
pub(super) struct Learnt {
    pub(super) origin: Origin,
    pub(super) inputs: Inputs,
    pub(super) gates: Gates,
    /// The regression with the place in the room, and the one relative to the start.
    pub(super) ridges: [LocalRidge; 2],
    /// Index of the regression that gives the time, and of the one that gives the normal.
    pub(super) time_from: usize,
    pub(super) normal_from: usize,
    pub(super) correction: Correction,
    pub(super) primitive: Option<Primitive>,
    pub(super) places: Option<Places>,
    pub(super) blend: Blend,
    pub(super) combination: Combination,
    pub(super) frame: Frame,
    /// Does the model rely on each of the [`cues`](Inputs::cues)?
    pub(super) relied_on: Vec<bool>,
}

/// Training data of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Origin {
    pub(super) reaches: usize,
    pub(super) people: usize,
    pub(super) median_duration_s: f64,
}

/// Follows a reach with a [`LearnedModel`](super::LearnedModel). Only the first step of a reach and [`begin`](ContactEstimator::begin) allocate.
///
/// While the touching point is missing, another point of the hand replaces it. While no point is seen, the last estimate is repeated for up to 0.1
/// s, with the time to contact counting down. If a required point, or gaze, has not been seen in a reach for 0.1 s, a model without that input
/// takes over.
#[derive(Debug, Clone)]
pub struct LearnedEstimator {
    learnt: Arc<Learnt>,
    track: ReachTrack,
    run: Option<PrimitiveRun>,
    features: Vec<f64>,
    scaled: Vec<f64>,
    gates: Vec<f64>,
    last: Option<ContactEstimate>,
    adaptation: Adaptation,
    /// Required inputs in addition to the touching point.
    relied_on: Vec<Cue>,
    alone: Option<Box<LearnedEstimator>>,
    /// Did the smaller model give the last estimate of this reach?
    answered_alone: bool,
    /// `answered_alone` of the previous reach while this one is tentative: a touch still belongs to the previous reach.
    before_alone: Option<bool>,
}

impl ContactEstimator for LearnedEstimator {
    fn training_reaches(&self) -> Option<usize> {
        Some(self.learnt.origin.reaches)
    }

    fn begin(&mut self) {
        self.adaptation.begin();
        self.answered_alone = false;
        self.before_alone = None;
        self.follow_anew();
        if let Some(alone) = &mut self.alone {
            alone.begin();
        }
    }

    fn begin_tentatively(&mut self) -> bool {
        self.adaptation.begin_tentatively();
        let answered_alone = std::mem::take(&mut self.answered_alone);
        self.before_alone.get_or_insert(answered_alone);
        self.follow_anew();
        if let Some(alone) = &mut self.alone {
            alone.begin_tentatively();
        }
        true
    }

    fn confirm(&mut self) {
        self.adaptation.confirm();
        self.before_alone = None;
        if let Some(alone) = &mut self.alone {
            alone.confirm();
        }
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        // Only the model that gave the estimates learns from the touch.
        let answered_alone = self.before_alone.unwrap_or(self.answered_alone);
        match self.alone.as_mut().filter(|_| answered_alone) {
            Some(alone) => alone.touched(contact_m, contact_s),
            None if contact_m.is_finite() && contact_s.is_finite() => {
                let blend = &self.learnt.blend;
                self.adaptation.touched(contact_m, contact_s, blend);
            }
            None => {}
        }
    }

    fn forget(&mut self) {
        self.adaptation = self.learnt.blend.fresh();
        self.answered_alone = false;
        self.before_alone = None;
        if let Some(alone) = &mut self.alone {
            alone.forget();
        }
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        if !self.track.push(frame) {
            return self.unseen(frame.t_s);
        }
        self.last = self.seen();
        let track = &self.track;
        let waits = self.relied_on.iter().any(|cue| !track.has_seen(*cue));
        self.answered_alone = false;
        // A required input not seen so far was missing from the start, so the smaller model has followed the whole reach.
        if let Some(alone) = self.alone.as_mut().filter(|_| waits) {
            let estimate = alone.step(frame);
            if estimate.is_some() && track.followed_s() >= WAITED_S {
                self.answered_alone = true;
                self.last = estimate;
            }
        }
        self.last
    }
}

impl LearnedEstimator {
    /// `alone`: takes over while a required input is missing.
    pub(super) fn new(learnt: &Arc<Learnt>, alone: Option<Self>) -> Self {
        let cues = learnt.inputs.cues().zip(&learnt.relied_on);
        Self {
            relied_on: cues
                .filter_map(|(cue, relied)| relied.then_some(cue))
                .collect(),
            alone: alone.map(Box::new),
            answered_alone: false,
            before_alone: None,
            track: ReachTrack::new(&learnt.inputs),
            run: learnt.primitive.as_ref().map(PrimitiveRun::new),
            features: Vec::with_capacity(learnt.inputs.width()),
            scaled: Vec::with_capacity(learnt.inputs.width() + Correction::ADDED),
            adaptation: learnt.blend.fresh(),
            gates: Vec::with_capacity(learnt.gates.len()),
            last: None,
            learnt: Arc::clone(learnt),
        }
    }

    fn follow_anew(&mut self) {
        self.last = None;
        self.track.begin();
        if let Some(run) = &mut self.run {
            run.begin();
        }
    }

    /// The last estimate, extrapolated to a sample that shows no point.
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
        let mut outputs = [[0.0; OUTPUTS]; 2];
        for (ridge, out) in learnt.ridges.iter().zip(&mut outputs) {
            self.scaled.clone_from(&self.features);
            let out = &mut out[..ridge.outputs()];
            ridge.predict(&mut self.scaled, &self.gates, out);
        }
        let mut ends_m: Ends = [None; SOURCES];
        for (source, out) in [Source::Room, Source::Start].into_iter().zip(&outputs) {
            ends_m[source as usize] = Some(now_m + DVec3::from_slice(&out[..3]));
        }
        ends_m[Source::Primitive as usize] = primitive_m;
        ends_m[Source::Hold as usize] = Some(now_m);
        let both = [&outputs[0][..], &outputs[1][..]];
        Correction::features_into(&self.features, now_m, both, &mut self.scaled);
        let corrected = learnt.correction.at(&self.scaled, &self.gates);
        ends_m[Source::Trees as usize] = ends_m[Source::Start as usize].map(|e| e + corrected);
        let ends_m = of_combination(learnt.combination, learnt.frame, ends_m);
        let predicted_s = outputs[learnt.time_from][3].max(0.0);
        let hats = between_knots(&learnt.blend.knots, time_key(predicted_s));
        let region = Region::between(&learnt.blend.regions, &self.gates);
        let adapted = self.adaptation.at(&hats);
        let mut corrected_m = ends_m;
        for (end_m, bias_m) in corrected_m.iter_mut().zip(&adapted.bias_m) {
            *end_m = end_m.map(|end_m| end_m - *bias_m);
        }
        let combined = combine(&region, &corrected_m, &adapted.ratios)?;
        let left = WayLeft {
            now_m,
            end_m: combined.point_m,
            variance_m2: region.axis_variance_m2(),
        };
        let personal = &learnt.blend.personal;
        let combined_m = self.adaptation.by_habit_m(&hats, personal, &left);
        let share = self.adaptation.share(&hats, region.share);
        let own_m = self.adaptation.own_m();
        let places = learnt.places.as_ref();
        let (said_m, placed_m) = placed(places, &region, share, combined_m, own_m, None);
        let said_m = learnt
            .blend
            .arrival
            .stop_m(&self.track.progress(), now_m, said_m);
        let factor = learnt.blend.doubt(&region, combined.apart_m2) * learnt.blend.at_time(&hats);
        let covariance = |spread: f64| {
            let blend = &learnt.blend;
            blend.covariance_m2(&region, factor * spread, start_m, said_m)
        };
        let normal = (learnt.ridges[0].outputs() == OUTPUTS)
            .then(|| DVec3::from_slice(&outputs[learnt.normal_from][4..7]));
        let estimate = ContactEstimate {
            t_s,
            point_m: said_m,
            covariance_m2: Some(covariance(adapted.spread)),
            normal: normal.and_then(DVec3::try_normalize),
            time_to_contact_s: Some(TimeToContact {
                mean_s: (predicted_s + adapted.late_s).max(0.0),
                sd_s: Some(region.time_sd_s() * adapted.time_spread.sqrt()),
            }),
        };
        if !estimate.is_finite() {
            return None;
        }
        self.adaptation.remember(
            &hats,
            personal,
            Pending {
                ends_m,
                squares_m2: Pending::squares_m2(&region),
                contact_s: t_s + predicted_s,
                time_s2: region.time_s2,
                left,
                combined_m,
                placed_m,
                said_m,
                way_m2: region.placed * region.size_m2,
                covariance_m2: covariance(1.0),
            },
        );
        Some(estimate)
    }

    /// Number of touches reported since the last `forget`.
    #[must_use]
    pub fn touches(&self) -> usize {
        self.adaptation.touches() + self.alone.as_ref().map_or(0, |alone| alone.touches())
    }

    /// Squared errors of the last touches relative to the expected ones, per axis: normally about 1. Values far above 1 mean that something in the
    /// room has moved or that the person has changed. They refer to the model that answers: the smaller one while a required input is missing.
    #[must_use]
    pub fn surprise(&self) -> f64 {
        let answered_alone = self.before_alone.unwrap_or(self.answered_alone);
        match self.alone.as_ref().filter(|_| answered_alone) {
            Some(alone) => alone.surprise(),
            None => self.adaptation.surprise(),
        }
    }
}
