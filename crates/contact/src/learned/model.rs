//! A learned model: a regression of the end beside an interaction primitive.

use super::config::{Combination, LearnedConfig};
use super::estimator::{LearnedEstimator, Learnt, Origin};
use super::held_out_errors::{HeldOut, weighted_quantile};
use super::reach_track::Inputs;
use super::samples;
use super::training::{self, OUTPUTS};
use crate::error::ContactError;
use crate::reach_set::{held_out_groups, references, touching_point};
use hwall_hand::{HandPoint, LabelledReach};
use std::borrow::Borrow;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Fewest reaches to learn from.
const FEWEST: usize = 8;

/// What was learnt from labelled reaches: where a reach like them ends.
///
/// There are two sources: a ridge regression of the way left, linear in the motion so far, with coefficients
/// that change with the progress of the reach; and a Bayesian interaction primitive of the touching
/// point. Both look at the same samples, so their errors are correlated. They are weighted, with one weight
/// per region of progress, by the joint second moments of their errors on held-out people (or reaches, with
/// fewer than three people): the scalar case of [Bar-Shalom 1986]. The covariance of an estimate is that of
/// the combination, with a factor that makes 90 % regions hold 90 % of the held-out
/// ends on average. Ridges, points of the hand and the noise of the primitive are chosen on the same
/// held-out reaches, which makes the factor a little optimistic.
#[derive(Debug, Clone)]
pub struct LearnedModel {
    pub(super) learnt: Arc<Learnt>,
}

impl LearnedModel {
    /// Learns from reaches that are all in one frame.
    ///
    /// # Errors
    /// Fewer than eight reaches, a reach that [`LabelledReach::validate`] refuses or that has another
    /// touching point than the first, a setting out of range.
    pub fn train<R: Borrow<LabelledReach>>(
        reaches: &[R],
        config: &LearnedConfig,
    ) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
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
        let mut samples = samples::of(&inputs, reaches, &folds, config);
        let primitive = match config.combination {
            Combination::Regression => None,
            _ => Some(training::primitive(
                &inputs,
                reaches,
                &folds,
                &mut samples,
                config,
            )?),
        };
        let gates = training::gates(&samples, config.regions);
        let normals = reaches.iter().all(|r| r.normal.is_some());
        let (rows, fitted) = training::regression(&inputs, &samples, &gates, normals)?;
        let errors = HeldOut::of(&samples, &rows, &fitted.held_out, config.combination);
        Ok(Self {
            learnt: Arc::new(Learnt {
                origin: origin(reaches),
                inputs,
                gates,
                ridge: fitted.ridge,
                primitive,
                errors,
                combination: config.combination,
            }),
        })
    }

    /// Number of reaches it was learnt from.
    #[must_use]
    pub fn reaches(&self) -> usize {
        self.learnt.origin.reaches
    }

    /// Number of people who made them, as far as they are named.
    #[must_use]
    pub fn people(&self) -> usize {
        self.learnt.origin.people
    }

    /// Median duration of those reaches, s.
    #[must_use]
    pub fn median_duration_s(&self) -> f64 {
        self.learnt.origin.median_duration_s
    }

    /// The point of the hand whose contact is predicted.
    #[must_use]
    pub fn touching_point(&self) -> HandPoint {
        self.learnt.inputs.point
    }

    /// Whether normals of surfaces were learnt, which takes one in every reach.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.learnt.ridge.outputs() == OUTPUTS
    }

    /// Which source says where the reach ends.
    #[must_use]
    pub fn combination(&self) -> Combination {
        self.learnt.combination
    }

    /// A new estimator. Estimators share what was learnt.
    #[must_use]
    pub fn estimator(&self) -> LearnedEstimator {
        LearnedEstimator::new(&self.learnt)
    }
}

fn origin(reaches: &[&LabelledReach]) -> Origin {
    let people: BTreeSet<_> = reaches.iter().filter_map(|r| r.person.as_ref()).collect();
    let durations = reaches.iter().map(|r| (r.duration_s(), 1.0));
    Origin {
        reaches: reaches.len(),
        people: people.len(),
        median_duration_s: weighted_quantile(0.5, durations),
    }
}
