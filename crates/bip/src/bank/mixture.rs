//! Several priors instead of one: by target or by person.
//!
//! One normal distribution over many targets and people is a blurred prior. A mixture keeps the mean (and optionally the covariance) of each group;
//! a [`Bank`] weights the components online.

use super::component::Component;
use super::config::BankConfig;
use super::filter_bank::Bank;
use crate::error::{BipError, length};
use crate::model::{Model, Tuning};
use crate::train::{Demonstration, Trainer, TrainingConfig};

/// The covariance of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Covariance {
    /// The covariance of all demonstrations around the means of their groups. Better with a few dozen demonstrations, because no direction in which
    /// people differ is lost.
    #[default]
    Shared,
    /// The covariance of its own group; needs many demonstrations in each group, at least two.
    Own,
}

/// Models of several groups of demonstrations and their prior probabilities.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    models: Vec<Model>,
    probabilities: Vec<f64>,
    members: Vec<Vec<usize>>,
}

impl Mixture {
    /// Trains one model for each group; its probability is its share of the demonstrations. `labels` has one number per demonstration, e.g. its
    /// target or its person.
    ///
    /// # Errors
    /// No demonstration, a wrong number of labels, a group of one demonstration with [`Covariance::Own`], errors of [`Model::train`].
    pub fn train(
        demonstrations: &[Demonstration],
        config: &TrainingConfig,
        labels: &[usize],
        covariance: Covariance,
    ) -> Result<Self, BipError> {
        let n = demonstrations.len();
        if n == 0 {
            return Err(BipError::TooFewDemonstrations { needed: 1, got: 0 });
        }
        let (demonstrations, config) = config.trimmed(demonstrations)?;
        let (demonstrations, config) = (&demonstrations[..], &config);
        length("labels", n, labels.len())?;
        let mut names = labels.to_vec();
        names.sort_unstable();
        names.dedup();
        let members: Vec<Vec<usize>> = names
            .iter()
            .map(|name| (0..n).filter(|i| labels[*i] == *name).collect())
            .collect();
        let models = match covariance {
            Covariance::Shared => {
                let mut trainer = Trainer::new(config.clone())?;
                for demonstration in demonstrations {
                    trainer.add(demonstration)?;
                }
                let places: Vec<usize> = labels
                    .iter()
                    .map(|label| names.partition_point(|name| name < label))
                    .collect();
                trainer.models_of_groups(&places, names.len())?
            }
            Covariance::Own => members
                .iter()
                .map(|members| {
                    if members.len() < 2 {
                        return Err(BipError::TooFewDemonstrations {
                            needed: 2,
                            got: members.len(),
                        });
                    }
                    let group: Vec<Demonstration> =
                        members.iter().map(|&i| demonstrations[i].clone()).collect();
                    Model::train(&group, config)
                })
                .collect::<Result<_, _>>()?,
        };
        Ok(Self {
            models,
            probabilities: members.iter().map(|m| m.len() as f64 / n as f64).collect(),
            members,
        })
    }

    /// Models of the components, in the order of their labels.
    #[must_use]
    pub fn models(&self) -> &[Model] {
        &self.models
    }

    /// Prior probabilities of the components; they sum to one.
    #[must_use]
    pub fn probabilities(&self) -> &[f64] {
        &self.probabilities
    }

    /// Indices of the demonstrations of each component.
    #[must_use]
    pub fn members(&self) -> &[Vec<usize>] {
        &self.members
    }

    /// The same mixture with these parameters for the filters of every component.
    ///
    /// # Errors
    /// As [`Model::with_tuning`].
    pub fn with_tuning(mut self, tuning: Tuning) -> Result<Self, BipError> {
        self.models = self
            .models
            .into_iter()
            .map(|m| m.with_tuning(tuning))
            .collect::<Result<_, _>>()?;
        Ok(self)
    }

    /// A bank of filters over all components.
    ///
    /// # Errors
    /// As [`Bank::of_components`].
    pub fn bank(&self, config: &BankConfig) -> Result<Bank, BipError> {
        let components: Vec<Component<'_>> = self
            .models
            .iter()
            .zip(&self.probabilities)
            .map(|(model, &probability)| Component { model, probability })
            .collect();
        Bank::of_components(&components, config)
    }
}
