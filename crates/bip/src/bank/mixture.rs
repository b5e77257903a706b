//! Several priors instead of one: by target, by person, or by clusters of end points.
//!
//! One normal distribution over many targets and people is a blurred prior. A mixture keeps the mean
//! (and, if asked, the covariance) of each group; a [`Bank`] weighs the components while it observes.

use super::component::Component;
use super::config::BankConfig;
use super::filter_bank::Bank;
use crate::error::{BipError, length};
use crate::model::{Model, Tuning};
use crate::train::{Demonstration, Trainer, TrainingConfig};
use hwall_numeric::check;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// How demonstrations are grouped.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Grouping {
    /// One label for each demonstration, such as its target or its person; any numbers.
    Labels(Vec<usize>),
    /// By the last values of the degrees of freedom, each in units of its spread over the
    /// demonstrations (k-means). Groups of one demonstration are dissolved, so that there may be
    /// fewer than asked for.
    EndPoints {
        /// Most groups.
        clusters: usize,
        /// Seed of the first centres.
        seed: u64,
    },
}

/// Whose covariance a component has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Covariance {
    /// That of all demonstrations around the means of their groups: with a few dozen
    /// demonstrations the better choice, because none of the directions in which people differ is
    /// lost. Shrinkage is not applied.
    #[default]
    Shared,
    /// That of its own group, which needs many demonstrations in each group, at least two.
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
    /// Trains one model for each group; its probability is its share of the demonstrations.
    ///
    /// # Errors
    /// No demonstration, another number of labels than demonstrations, no cluster, with
    /// [`Covariance::Own`] a group of one demonstration, whatever [`Model::train`] refuses.
    pub fn train(
        demonstrations: &[Demonstration],
        config: &TrainingConfig,
        grouping: &Grouping,
        covariance: Covariance,
    ) -> Result<Self, BipError> {
        let n = demonstrations.len();
        if n == 0 {
            return Err(BipError::TooFewDemonstrations { needed: 1, got: 0 });
        }
        let (demonstrations, config) = config.trimmed(demonstrations)?;
        let (demonstrations, config) = (&demonstrations[..], &config);
        let labels = match grouping {
            Grouping::Labels(labels) => {
                length("labels", n, labels.len())?;
                labels.clone()
            }
            Grouping::EndPoints { clusters, seed } => {
                check::that(*clusters > 0, "clusters", 0.0, "at least 1")?;
                cluster(&ends(demonstrations)?, *clusters, *seed)
            }
        };
        let mut names = labels.clone();
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

    /// Prior probabilities of the components; they add up to one.
    #[must_use]
    pub fn probabilities(&self) -> &[f64] {
        &self.probabilities
    }

    /// Numbers of the demonstrations of each component.
    #[must_use]
    pub fn members(&self) -> &[Vec<usize>] {
        &self.members
    }

    /// The same with these parameters for the filters of every component.
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

/// Last sample of every demonstration, each column in units of its standard deviation.
fn ends(demonstrations: &[Demonstration]) -> Result<Vec<Vec<f64>>, BipError> {
    let Some(first) = demonstrations.first() else {
        return Err(BipError::TooFewDemonstrations { needed: 2, got: 0 });
    };
    let dofs = first.dofs();
    if let Some(i) = demonstrations.iter().position(|d| d.dofs() != dofs) {
        return Err(BipError::DofMismatch {
            demonstration: i,
            expected: dofs,
            got: demonstrations[i].dofs(),
        });
    }
    let n = demonstrations.len() as f64;
    let mut points: Vec<Vec<f64>> = demonstrations
        .iter()
        .map(|d| d.sample(d.len() - 1).to_vec())
        .collect();
    for d in 0..dofs {
        let mean = points.iter().map(|p| p[d] / n).sum::<f64>();
        let sd = (points.iter().map(|p| (p[d] - mean).powi(2)).sum::<f64>() / n).sqrt();
        for p in &mut points {
            // A constant column says nothing about groups.
            p[d] = if sd > 1e-12 * mean.abs() {
                (p[d] - mean) / sd
            } else {
                0.0
            };
        }
    }
    Ok(points)
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum()
}

fn nearest(point: &[f64], centres: &[Vec<f64>]) -> (usize, f64) {
    centres
        .iter()
        .enumerate()
        .map(|(c, centre)| (c, squared_distance(point, centre)))
        .fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a })
}

/// Rounds of k-means; with a few hundred points it converges long before.
const ROUNDS: usize = 100;

/// Starts of k-means, of which the tightest result is kept.
const STARTS: usize = 10;

/// Labels of k-means, first centres drawn by squared distance [Arthur 2007].
fn cluster(points: &[Vec<f64>], clusters: usize, seed: u64) -> Vec<usize> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut best = (f64::INFINITY, Vec::new());
    for _ in 0..STARTS {
        let (spread, labels) = cluster_once(points, clusters, &mut rng);
        if spread < best.0 {
            best = (spread, labels);
        }
    }
    best.1
}

/// Sum of squared distances from the centres, and labels.
fn cluster_once(points: &[Vec<f64>], clusters: usize, rng: &mut Pcg64) -> (f64, Vec<usize>) {
    let mut centres = vec![points[rng.random_range(0..points.len())].clone()];
    while centres.len() < clusters.min(points.len()) {
        let distances: Vec<f64> = points.iter().map(|p| nearest(p, &centres).1).collect();
        let total: f64 = distances.iter().sum();
        if total <= 0.0 {
            break; // all points are centres already
        }
        let mut left = rng.random::<f64>() * total;
        let chosen = distances.iter().position(|d| {
            left -= d;
            left < 0.0
        });
        centres.push(points[chosen.unwrap_or(points.len() - 1)].clone());
    }
    let mut labels = Vec::new();
    for _ in 0..ROUNDS {
        let next = loop {
            let next: Vec<usize> = points.iter().map(|p| nearest(p, &centres).0).collect();
            let lonely = (0..centres.len())
                .find(|c| centres.len() > 1 && next.iter().filter(|l| *l == c).count() < 2);
            match lonely {
                Some(lonely) => drop(centres.remove(lonely)),
                None => break next,
            }
        };
        if next == labels {
            break;
        }
        for (c, centre) in centres.iter_mut().enumerate() {
            let members: Vec<&Vec<f64>> = points
                .iter()
                .zip(&next)
                .filter(|(_, l)| **l == c)
                .map(|(p, _)| p)
                .collect();
            for (d, x) in centre.iter_mut().enumerate() {
                *x = members.iter().map(|p| p[d]).sum::<f64>() / members.len() as f64;
            }
        }
        labels = next;
    }
    let spread = points.iter().map(|p| nearest(p, &centres).1).sum();
    (spread, labels)
}
