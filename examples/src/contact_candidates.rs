//! Who competes in the study: the one list of estimators.

use hwall_contact::{
    Combination, ConstantVelocity, ContactError, ContactEstimator, Hold, LabelledReach,
    LearnedConfig, LearnedEstimator, LearnedModel, MinimumJerk, NearestNeighbour, RidgeWindow,
};

/// A trained estimator, ready for reaches that it has not seen.
pub type Trained = Box<dyn ContactEstimator + Send>;

/// How to train an estimator; called once a fold, folds side by side.
pub type Train = Box<dyn Fn(&[LabelledReach]) -> anyhow::Result<Trained> + Sync>;

/// What a candidate may learn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearnsFrom {
    /// Reaches that are not judged.
    Others,
    /// The very reach that is judged, for what no estimator can know: a bound, no competitor.
    Itself,
}

/// One way to foresee the end of a reach.
pub struct Candidate {
    /// For tables and legends.
    pub name: String,
    /// What it is trained with.
    pub learns_from: LearnsFrom,
    /// Trains it.
    pub train: Train,
}

/// Everyone in the tables, in their order.
#[must_use]
pub fn all() -> Vec<Candidate> {
    vec![
        Candidate::of("hold", Hold::train),
        Candidate::of("constant velocity", ConstantVelocity::train),
        Candidate {
            learns_from: LearnsFrom::Itself,
            ..Candidate::of("constant velocity, arrival known", ConstantVelocity::train)
        },
        Candidate::of("minimum jerk", MinimumJerk::train),
        Candidate::of("nearest neighbours", NearestNeighbour::train),
        Candidate::of("ridge on five frames", RidgeWindow::train),
        Candidate::of("interaction primitive", learned(Combination::Primitive)),
        Candidate::of("local regression", learned(Combination::Regression)),
        Candidate::of("learned: both", learned(Combination::Both)),
    ]
}

/// The learned estimator, or one of its two sources.
fn learned(
    combination: Combination,
) -> impl Fn(&[LabelledReach]) -> Result<LearnedEstimator, ContactError> {
    let config = LearnedConfig {
        combination,
        ..LearnedConfig::default()
    };
    move |reaches| Ok(LearnedModel::train(reaches, &config)?.estimator())
}

impl Candidate {
    /// Trained on others.
    pub fn of<E: ContactEstimator + Send + 'static>(
        name: &str,
        train: impl Fn(&[LabelledReach]) -> Result<E, ContactError> + Sync + 'static,
    ) -> Self {
        Self {
            name: name.to_owned(),
            learns_from: LearnsFrom::Others,
            train: Box::new(move |reaches| Ok(Box::new(train(reaches)?))),
        }
    }
}
