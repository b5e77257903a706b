//! The learned estimator: a regression of the end beside an interaction primitive.

use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::gates::Gates;
use crate::held_out_errors::{HeldOut, weighted_quantile};
use crate::learning::{self, OUTPUTS};
use crate::local_ridge::LocalRidge;
use crate::primitive::{Follower, Primitive};
use crate::reach_set::{held_out_groups, touching_point};
use crate::reach_track::{Inputs, MOST_LAGS, ReachTrack};
use glam::DVec3;
use hwall_bip::Basis;
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;
use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Longest time without any point of the hand that is bridged, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Fewest reaches to learn from.
const FEWEST: usize = 8;

/// Who says where the reach ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combination {
    /// The regression alone.
    Regression,
    /// The interaction primitive; the regression where that has lost its way. Time and normal are the
    /// regression's.
    Primitive,
    /// Both, weighted by the joint covariance of their errors on held-out reaches.
    #[default]
    Both,
}

/// How a [`LearnedModel`] is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedConfig {
    /// Who says where the reach ends. Default both.
    pub combination: Combination,
    /// Let the regression see the direction of gaze. Default `false`: a fusion with a scene weighs the
    /// gaze by itself, and it is not there in every study.
    pub gaze: bool,
    /// Regions of progress, each with coefficients of its own. Default 16; 1 is plain ridge
    /// regression.
    pub regions: usize,
    /// Samples of each reach to learn from. Default 30.
    pub samples_per_reach: usize,
    /// Steps back in time that the regression compares the hand with, the first 0.03 s long and each
    /// next one twice as long; 8 at most. Default 4: a window of 0.24 s.
    pub lags: usize,
    /// Basis of the interaction primitive. Default 9 normalised Gaussians.
    pub basis: Basis,
    /// Most directions in which the primitive lets reaches differ: what a step costs grows with them.
    /// Default 24.
    pub rank: usize,
    /// Most parts that the reaches are held out in; whole persons where there are three or more. Default 16.
    pub folds: usize,
}

impl Default for LearnedConfig {
    fn default() -> Self {
        Self {
            combination: Combination::Both,
            gaze: false,
            regions: 16,
            samples_per_reach: 30,
            lags: 4,
            basis: Basis::normalized_gaussian(9),
            rank: 24,
            folds: 16,
        }
    }
}

impl LearnedConfig {
    fn validate(&self) -> Result<(), ArgumentError> {
        let within = |what, value: usize, range: RangeInclusive<usize>, wanted| {
            that(range.contains(&value), what, value as f64, wanted)
        };
        within("regions", self.regions, 1..=usize::MAX, "at least 1")?;
        within(
            "samples_per_reach",
            self.samples_per_reach,
            1..=usize::MAX,
            "at least 1",
        )?;
        within("lags", self.lags, 0..=MOST_LAGS, "at most 8")?;
        within("rank", self.rank, 1..=usize::MAX, "at least 1")?;
        within("folds", self.folds, 2..=usize::MAX, "at least 2")?;
        Ok(())
    }
}

/// What was learnt from labelled reaches: where a reach like them ends.
///
/// Two sources. A ridge regression of the way left, linear in the motion so far, with coefficients
/// that change with the progress of the reach; and a Bayesian interaction primitive of the touching
/// point. Both look at the same samples, so their errors are correlated: the weights follow from the
/// joint second moments of their errors on people (or, with fewer than three, reaches) that were held
/// out, one weight a region of progress: the scalar case of [Bar-Shalom 1986]. The covariance of the
/// answer is that of the combination, with a factor that makes 90 % regions hold 90 % of the held-out
/// ends on average. Ridges, points of the hand and the noise of the primitive are chosen on the same
/// held-out reaches, which makes the factor a little optimistic.
#[derive(Debug, Clone)]
pub struct LearnedModel {
    pub(crate) learnt: Arc<Learnt>,
}

#[derive(Debug)]
pub(crate) struct Learnt {
    pub(crate) origin: Origin,
    pub(crate) inputs: Inputs,
    pub(crate) gates: Gates,
    pub(crate) ridge: LocalRidge,
    pub(crate) primitive: Option<Primitive>,
    pub(crate) errors: HeldOut,
    pub(crate) combination: Combination,
}

/// What a model was learnt from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Origin {
    pub(crate) reaches: usize,
    pub(crate) people: usize,
    pub(crate) median_duration_s: f64,
}

impl Origin {
    fn of(reaches: &[LabelledReach]) -> Self {
        let people: BTreeSet<_> = reaches.iter().filter_map(|r| r.person.as_ref()).collect();
        let durations = reaches.iter().map(|r| (r.duration_s(), 1.0));
        Self {
            reaches: reaches.len(),
            people: people.len(),
            median_duration_s: weighted_quantile(0.5, durations),
        }
    }
}

impl LearnedModel {
    /// Learns from reaches of one frame, as many people as there are.
    ///
    /// # Errors
    /// Fewer than eight reaches, a reach that nothing can be learnt from or with another touching point
    /// than the first, no regions or samples.
    pub fn train(reaches: &[LabelledReach], config: &LearnedConfig) -> Result<Self, ContactError> {
        config.validate()?;
        if reaches.len() < FEWEST {
            return Err(ContactError::TooFewReaches {
                got: reaches.len(),
                needed: FEWEST,
            });
        }
        touching_point(reaches)?;
        let inputs = Inputs::of(reaches, config.gaze, config.lags);
        let folds = held_out_groups(reaches, config.folds, config.folds);
        let mut samples = learning::samples(&inputs, reaches, &folds, config);
        let primitive = match config.combination {
            Combination::Regression => None,
            _ => Some(learning::primitive(
                &inputs,
                reaches,
                &folds,
                &mut samples,
                config,
            )?),
        };
        let gates = learning::gates(&samples, config.regions);
        let normals = reaches.iter().all(|r| r.normal.is_some());
        let (rows, fitted) = learning::regression(&inputs, &samples, &gates, normals)?;
        let errors = HeldOut::of(&samples, &rows, &fitted.held_out, config.combination);
        Ok(Self {
            learnt: Arc::new(Learnt {
                origin: Origin::of(reaches),
                inputs,
                gates,
                ridge: fitted.ridge,
                primitive,
                errors,
                combination: config.combination,
            }),
        })
    }

    /// Reaches it was learnt from.
    #[must_use]
    pub fn reaches(&self) -> usize {
        self.learnt.origin.reaches
    }

    /// People among them, as far as they are named.
    #[must_use]
    pub fn people(&self) -> usize {
        self.learnt.origin.people
    }

    /// Half of those reaches last no longer, s.
    #[must_use]
    pub fn median_duration_s(&self) -> f64 {
        self.learnt.origin.median_duration_s
    }

    /// The point of the hand whose contact is foreseen.
    #[must_use]
    pub fn touching_point(&self) -> HandPoint {
        self.learnt.inputs.point
    }

    /// Whether normals of surfaces were learnt: where every reach had one.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.learnt.ridge.outputs() == OUTPUTS
    }

    /// Who says where the reach ends.
    #[must_use]
    pub fn combination(&self) -> Combination {
        self.learnt.combination
    }

    /// An estimator that waits for a reach. Estimators share what was learnt.
    #[must_use]
    pub fn estimator(&self) -> LearnedEstimator {
        let learnt = &self.learnt;
        LearnedEstimator {
            track: ReachTrack::new(&learnt.inputs),
            follower: learnt.primitive.as_ref().map(Follower::new),
            features: Vec::with_capacity(learnt.inputs.widths()[0]),
            gates: Vec::with_capacity(learnt.gates.len()),
            last: None,
            learnt: Arc::clone(learnt),
        }
    }
}

/// Follows a reach with a [`LearnedModel`]. A step does not allocate after the first of a reach;
/// [`begin`](ContactEstimator::begin) does.
///
/// A finger that is missing is bridged by another point of the hand; while none is seen at all the last
/// answer stands for up to 0.1 s, its time to contact running down.
#[derive(Debug, Clone)]
pub struct LearnedEstimator {
    learnt: Arc<Learnt>,
    track: ReachTrack,
    follower: Option<Follower>,
    features: Vec<f64>,
    gates: Vec<f64>,
    last: Option<ContactEstimate>,
}

impl ContactEstimator for LearnedEstimator {
    fn begin(&mut self) {
        self.last = None;
        self.track.begin();
        if let Some(follower) = &mut self.follower {
            follower.begin();
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
    /// The last answer, for a time at which nothing was seen.
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

    /// The answer to the latest sample of the track.
    fn seen(&mut self) -> Option<ContactEstimate> {
        let (t_s, now_m) = self.track.now()?;
        let (_, start_m) = self.track.start()?;
        let primitive_m = self.follower.as_mut().and_then(|follower| {
            follower.step(&self.learnt.inputs, &self.track).ok()?;
            follower.end().ok()?
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
        let (point_m, covariance_m2) = learnt.errors.estimate(
            &errors,
            learnt.combination,
            start_m,
            regression_m,
            primitive_m,
        );
        let normal = (out.len() == OUTPUTS).then(|| DVec3::from_slice(&out[4..7]));
        let estimate = ContactEstimate {
            t_s,
            point_m,
            covariance_m2: Some(covariance_m2),
            normal: normal.and_then(DVec3::try_normalize),
            time_to_contact_s: Some(TimeToContact {
                mean_s: out[3].max(0.0),
                sd_s: Some(errors.time_sd_s()),
            }),
        };
        estimate.is_finite().then_some(estimate)
    }
}
