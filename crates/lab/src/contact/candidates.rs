//! The estimators that are compared.

use hwall_contact::{
    Combination, ConstantVelocity, ContactError, ContactEstimator, Hold, LearnedConfig,
    LearnedEstimator, LearnedModel, MinimumJerk, NearestNeighbour, RidgeWindow,
};
use hwall_hand::LabelledReach;

/// A trained estimator, for held-out reaches.
pub type BoxedEstimator = Box<dyn ContactEstimator + Send>;

/// Trains an estimator; called once per fold, in parallel.
pub type TrainFn = Box<dyn Fn(&[&LabelledReach]) -> anyhow::Result<BoxedEstimator> + Sync>;

/// Role of a candidate in the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A baseline for the learned estimator.
    Baseline,
    /// A part of the learned estimator, to show its contribution.
    Part,
    /// The learned estimator.
    Learned,
}

/// One estimator of the end of a reach.
pub struct Candidate {
    /// For tables and legends.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Trains it.
    pub train: TrainFn,
}

/// All candidates, in the order of the tables; `config`: for the learned estimator and its parts.
pub fn all(config: LearnedConfig) -> Vec<Candidate> {
    let of = |combination, name, role| Candidate {
        role,
        ..Candidate::of(name, learned(combination, config))
    };
    vec![
        Candidate::of("hold", |r| Hold::train(r)),
        Candidate::of("constant velocity", |r| ConstantVelocity::train(r)),
        Candidate::of("minimum jerk", |r| MinimumJerk::train(r)),
        Candidate::of("nearest neighbours", |r| NearestNeighbour::train(r)),
        Candidate::of("ridge on five frames", |r| RidgeWindow::train(r)),
        of(
            Combination::Primitive,
            "interaction primitive",
            Role::Baseline,
        ),
        of(Combination::Regression, "local regression", Role::Part),
        of(Combination::Both, "learned", Role::Learned),
    ]
}

/// The learned estimator, or one of its two sources.
fn learned(
    combination: Combination,
    config: LearnedConfig,
) -> impl Fn(&[&LabelledReach]) -> Result<LearnedEstimator, ContactError> {
    let config = LearnedConfig {
        combination,
        ..config
    };
    move |reaches| Ok(LearnedModel::train(reaches, &config)?.estimator())
}

impl Candidate {
    /// A baseline.
    pub fn of<E: ContactEstimator + Send + 'static>(
        name: &str,
        train: impl Fn(&[&LabelledReach]) -> Result<E, ContactError> + Sync + 'static,
    ) -> Self {
        Self {
            name: name.to_owned(),
            role: Role::Baseline,
            train: Box::new(move |reaches| Ok(Box::new(train(reaches)?))),
        }
    }
}
