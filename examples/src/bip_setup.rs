//! What the command line says about a filter: basis, degrees of freedom, mode, noise; and training.

use crate::trajectories::TrajectorySet;
use anyhow::{Context, bail, ensure};
use hwall_bip::{Basis, Group, Model, NoiseSource, TrainingConfig};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Degrees of freedom, from 0: `0-17,20`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Indices(Vec<usize>);

/// More columns than any recording has.
const MOST_COLUMNS: usize = 10_000;

impl FromStr for Indices {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let number = |word: &str| {
            let number: Option<usize> = word.trim().parse().ok().filter(|n| *n < MOST_COLUMNS);
            number.with_context(|| format!("{word:?} is no column index"))
        };
        let range = |part: &str| -> anyhow::Result<RangeInclusive<usize>> {
            let (from, to) = part.split_once('-').unwrap_or((part, part));
            let (from, to) = (number(from)?, number(to)?);
            ensure!(from <= to, "{part:?} runs backwards");
            Ok(from..=to)
        };
        let mut indices = Vec::new();
        for part in text.split(',') {
            indices.extend(range(part)?);
        }
        indices.sort_unstable();
        if let Some(twice) = indices.windows(2).find(|w| w[0] == w[1]) {
            bail!("column {} is listed twice", twice[0]);
        }
        Ok(Self(indices))
    }
}

/// `poly:8`, `gauss:6:0.04`, `gauss:6`, `ngauss:8`, `sigmoid:6:0.1`, `legendre:8`, `chebyshev:8`.
///
/// # Errors
/// Another name, a count outside 1 to 100, a variance or width that is not positive.
pub fn basis(text: &str) -> anyhow::Result<Basis> {
    let words: Vec<&str> = text.split(':').collect();
    let count = |word: &str| {
        let count: Option<usize> = word.parse().ok().filter(|n| (1..=100).contains(n));
        count.with_context(|| format!("{word:?} functions, expected 1 to 100"))
    };
    let size = |word: &str| {
        let size: Option<f64> = word.parse().ok().filter(|v| *v > 0.0 && *v < f64::INFINITY);
        size.with_context(|| format!("{word:?} is not finite and positive"))
    };
    Ok(match words[..] {
        ["poly", n] => Basis::Polynomial { count: count(n)? },
        ["legendre", n] => Basis::Legendre { count: count(n)? },
        ["chebyshev", n] => Basis::Chebyshev { count: count(n)? },
        ["gauss", n] => Basis::gaussian(count(n)?),
        ["ngauss", n] => Basis::normalized_gaussian(count(n)?),
        ["gauss", n, v] => Basis::Gaussian {
            count: count(n)?,
            variance: size(v)?,
        },
        ["ngauss", n, v] => Basis::NormalizedGaussian {
            count: count(n)?,
            variance: size(v)?,
        },
        ["sigmoid", n, w] => Basis::Sigmoid {
            count: count(n)?,
            width: size(w)?,
        },
        _ => bail!("{text:?} is no basis"),
    })
}

/// Which filter runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The exact low-rank filter.
    Exact,
    /// The published one, on all weights.
    Compat,
    /// A bank of hypotheses.
    Bank,
    /// An ensemble with this many members.
    Ensemble(usize),
}

impl FromStr for Mode {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        Ok(match text.split_once(':') {
            None if text == "exact" => Self::Exact,
            None if text == "compat" => Self::Compat,
            None if text == "bank" => Self::Bank,
            Some(("ensemble", members)) => {
                let members: Option<usize> = members.parse().ok().filter(|n| *n > 1);
                Self::Ensemble(members.context("an ensemble has two members or more")?)
            }
            _ => bail!("{text:?} is none of exact, compat, bank, ensemble:N"),
        })
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => write!(f, "exact"),
            Self::Compat => write!(f, "compat"),
            Self::Bank => write!(f, "bank"),
            Self::Ensemble(members) => write!(f, "ensemble:{members}"),
        }
    }
}

/// Where the measurement noise comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// Residual of the fit.
    Fit,
    /// Residual of demonstrations left out one at a time.
    HeldOut,
    /// Residual of the fit, its variance times this.
    FitTimes(f64),
}

impl FromStr for Noise {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        Ok(match text {
            "fit" => Self::Fit,
            "loo" => Self::HeldOut,
            _ => {
                let factor: Option<f64> =
                    text.parse().ok().filter(|v| *v > 0.0 && *v < f64::INFINITY);
                let wanted = || format!("{text:?} is none of fit, loo, a positive number");
                Self::FitTimes(factor.with_context(wanted)?)
            }
        })
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fit => write!(f, "fit"),
            Self::HeldOut => write!(f, "loo"),
            Self::FitTimes(factor) => write!(f, "{factor} x fit"),
        }
    }
}

/// Everything about the model and the filter that the user chooses.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Basis of every degree of freedom.
    pub basis: Basis,
    /// Degrees of freedom that the filter sees.
    pub observed: Indices,
    /// Which filter.
    pub mode: Mode,
    /// Measurement noise.
    pub noise: Noise,
    /// Variance of the phase at the start.
    pub phase_variance: f64,
    /// Variance of the acceleration of the phase, 1/time⁴; `None`: the default of the library.
    pub process_variance: Option<f64>,
    /// Train as the published implementation does.
    pub published: bool,
}

/// A model, and what a filter of it sees.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model.
    pub model: Model,
    /// Degrees of freedom that the filter sees.
    pub observed: Vec<usize>,
    /// The others.
    pub inferred: Vec<usize>,
    /// Variance of the measurement noise in use, of each degree of freedom.
    pub noise: Vec<f64>,
}

impl Setup {
    /// Trains on all trajectories of a set.
    ///
    /// # Errors
    /// An observed column that is not there; whatever training says.
    pub fn train(&self, set: &TrajectorySet) -> anyhow::Result<Trained> {
        let dofs = set.columns.len();
        let Indices(observed) = &self.observed;
        if let Some(far) = observed.iter().find(|d| **d >= dofs) {
            bail!(
                "--observed names column {far}, the files have 0 to {}",
                dofs - 1
            );
        }
        let seen: Vec<bool> = (0..dofs).map(|d| observed.contains(&d)).collect();
        let groups = self.groups(&set.columns, &seen);
        let mut config = if self.trains_as_published() {
            TrainingConfig::published(groups)
        } else {
            TrainingConfig::new(groups)
        };
        if self.noise != Noise::HeldOut {
            config.held_out = 0;
        }
        let demonstrations = set
            .trajectories
            .iter()
            .map(|t| t.to_demonstration())
            .collect::<anyhow::Result<Vec<_>>>()?;
        let model = Model::train(&demonstrations, &config).context("training")?;
        let noise = match self.noise {
            Noise::Fit => model.noise_fit().to_vec(),
            Noise::FitTimes(factor) => model.noise_fit().iter().map(|v| v * factor).collect(),
            Noise::HeldOut => model
                .noise_held_out()
                .context("--noise loo needs two training files or more")?
                .to_vec(),
        };
        Ok(Trained {
            model,
            observed: observed.clone(),
            inferred: (0..dofs).filter(|d| !seen[*d]).collect(),
            noise,
        })
    }

    /// The published filter comes with the published training.
    #[must_use]
    pub fn trains_as_published(&self) -> bool {
        self.published || self.mode == Mode::Compat
    }

    /// Neighbouring columns with the same role share a group.
    fn groups(&self, columns: &[String], seen: &[bool]) -> Vec<Group> {
        let runs = seen.chunk_by(|a, b| a == b);
        let mut first = 0;
        runs.map(|run| {
            let name = format!("{}..{}", columns[first], columns[first + run.len() - 1]);
            first += run.len();
            if run[0] {
                Group::observed(&name, run.len(), self.basis)
            } else {
                Group::controlled(&name, run.len(), self.basis)
            }
        })
        .collect()
    }

    /// The noise that must accompany each observation, because the model does not have it.
    #[must_use]
    pub fn own_noise<'a>(&self, trained: &'a Trained) -> Option<&'a [f64]> {
        matches!(self.noise, Noise::FitTimes(_)).then_some(&trained.noise)
    }

    /// The noise that the library's filter can take from the model by itself.
    #[must_use]
    pub fn noise_source(&self) -> NoiseSource {
        match self.noise {
            Noise::Fit | Noise::FitTimes(_) => NoiseSource::Fit,
            Noise::HeldOut => NoiseSource::HeldOut,
        }
    }
}
