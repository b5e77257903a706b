//! Settings of a filter from the command line (basis, degrees of freedom, mode, noise), and its training.

use crate::bip::trajectories::TrajectorySet;
use anyhow::{Context, bail, ensure};
use hwall_bip::{
    Basis, Criterion, FilterConfig, Group, Model, NoiseSource, SelectionConfig, TrainingConfig,
    TuningConfig, default_candidates, select_groups, tune,
};
use hwall_stage::numbers::{count_within, positive};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Degrees of freedom, from 0: `0-17,20`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Indices(Vec<usize>);

/// More columns than any recording has.
const MOST_COLUMNS: usize = 10_000;
/// Largest number of members of an ensemble: each is a separate filter.
const MOST_MEMBERS: usize = 100_000;

impl FromStr for Indices {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let number = |word: &str| {
            let number: Option<usize> = word.trim().parse().ok().filter(|n| *n < MOST_COLUMNS);
            number.with_context(|| format!("{word:?} is not the index of a column"))
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

/// Which basis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BasisChoice {
    /// This one for every degree of freedom.
    Given(Basis),
    /// The best of the library's candidates by a criterion, separately for the observed degrees of freedom
    /// and for the others.
    Automatic(Criterion),
}

impl FromStr for BasisChoice {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        Ok(match text {
            "auto" => Self::Automatic(Criterion::LeaveOneOut),
            "auto:aic" => Self::Automatic(Criterion::Aic),
            "auto:bic" => Self::Automatic(Criterion::Bic),
            _ => Self::Given(basis(text)?),
        })
    }
}

/// `poly:8`, `gauss:6:0.04`, `gauss:6`, `ngauss:8`, `sigmoid:6:0.1`, `legendre:8`, `chebyshev:8`.
///
/// # Errors
/// Another name, a count outside 1 to 100, a variance or width that is not positive.
fn basis(text: &str) -> anyhow::Result<Basis> {
    let words: Vec<&str> = text.split(':').collect();
    let count = |word: &str| {
        let count = count_within::<1, 100>(word).ok();
        count.with_context(|| format!("{word:?} functions, expected 1 to 100"))
    };
    let size = |word: &str| {
        positive(word)
            .ok()
            .with_context(|| format!("{word:?} is not finite and positive"))
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
        _ => bail!("{text:?} is not a basis"),
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
        Ok(match (text, text.strip_prefix("ensemble:")) {
            ("exact", _) => Self::Exact,
            ("compat", _) => Self::Compat,
            ("bank", _) => Self::Bank,
            (_, Some(members)) => {
                let members = count_within::<2, MOST_MEMBERS>(members).ok();
                Self::Ensemble(members.context("an ensemble has 2 to 100000 members")?)
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
    /// Chosen by leave-one-out on demonstrations: their residual times a factor, and the variance of the acceleration that
    /// predict their ends best.
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
                let wanted = || format!("{text:?} is none of fit, loo, a positive number");
                Self::FitTimes(positive(text).ok().with_context(wanted)?)
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
    /// Basis of the degrees of freedom.
    pub basis: BasisChoice,
    /// Degrees of freedom that the filter sees.
    pub observed: Indices,
    /// Which filter.
    pub mode: Mode,
    /// Measurement noise.
    pub noise: Noise,
    /// Variance of the phase at the start.
    pub phase_variance: f64,
    /// Variance of the acceleration of the phase, 1/time⁴; `None`: the tuned one, else
    /// the default of the library.
    pub process_variance: Option<f64>,
    /// Train as the published implementation does.
    pub published: bool,
}

/// A trained model, and the observed columns of its filter.
#[derive(Debug, Clone)]
pub struct TrainedModel {
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
    /// A missing observed column; errors of training.
    pub fn train(&self, set: &TrajectorySet) -> anyhow::Result<TrainedModel> {
        let dofs = set.columns.len();
        let Indices(observed) = &self.observed;
        if let Some(far) = observed.iter().find(|d| **d >= dofs) {
            bail!(
                "--observed names column {far}, the files have 0 to {}",
                dofs - 1
            );
        }
        let seen: Vec<bool> = (0..dofs).map(|d| observed.contains(&d)).collect();
        let demonstrations = set.to_demonstrations()?;
        let first = match self.basis {
            BasisChoice::Given(basis) => basis,
            // Placeholder until a basis is chosen.
            BasisChoice::Automatic(_) => Basis::Legendre { count: 8 },
        };
        let mut groups = groups(&set.columns, &seen, first);
        if let BasisChoice::Automatic(criterion) = self.basis {
            let config = SelectionConfig::default();
            let candidates = default_candidates();
            groups = select_groups(&demonstrations, &groups, &candidates, criterion, &config)
                .context("choosing a basis")?;
        }
        let mut config = match self.trains_as_published() {
            true => TrainingConfig::published(groups),
            false => TrainingConfig::new(groups),
        };
        let tuned = self.noise == Noise::HeldOut && self.mode != Mode::Compat;
        let model = if tuned {
            let mut tuning = TuningConfig::new(&config);
            tuning.filter.phase_variance = self.phase_variance;
            if let Mode::Ensemble(_) = self.mode {
                tuning.correlation_times = vec![0.0];
            }
            tune(&demonstrations, &config, &tuning)
                .context("--noise loo, on training motions left out")?
                .model
        } else {
            if self.noise != Noise::HeldOut {
                config.held_out = 0;
            }
            Model::train(&demonstrations, &config).context("training")?
        };
        let (noise, factor) = match self.noise {
            Noise::Fit => (model.noise_fit(), 1.0),
            Noise::FitTimes(factor) => (model.noise_fit(), factor),
            Noise::HeldOut => {
                let noise = model.noise_held_out();
                let noise = noise.context("--noise loo needs two training files or more")?;
                (noise, model.tuning().map_or(1.0, |t| t.noise_factor))
            }
        };
        Ok(TrainedModel {
            noise: noise.iter().map(|v| v * factor).collect(),
            observed: observed.clone(),
            inferred: (0..dofs).filter(|d| !seen[*d]).collect(),
            model,
        })
    }

    /// Is the model trained as published? Always true for the published filter.
    pub fn trains_as_published(&self) -> bool {
        self.published || self.mode == Mode::Compat
    }

    /// Do predictions include the residual, so that they refer to measurements? In the published
    /// convention they refer only to the mean motion.
    pub fn predicts_measurements(&self) -> bool {
        self.noise == Noise::HeldOut && self.mode != Mode::Compat
    }

    /// The configuration of the requested filter.
    pub fn filter(&self) -> FilterConfig {
        let (noise, noise_factor) = match self.noise {
            Noise::Fit => (NoiseSource::Fit, None),
            Noise::FitTimes(factor) => (NoiseSource::Fit, Some(factor)),
            Noise::HeldOut => (NoiseSource::HeldOut, None),
        };
        FilterConfig {
            phase_variance: self.phase_variance,
            acceleration_variance: self.process_variance,
            noise,
            noise_factor,
            ..FilterConfig::default()
        }
    }
}

/// Neighbouring columns with the same role share a group.
fn groups(columns: &[String], seen: &[bool], basis: Basis) -> Vec<Group> {
    let runs = seen.chunk_by(|a, b| a == b);
    let mut first = 0;
    runs.map(|run| {
        let name = format!("{}..{}", columns[first], columns[first + run.len() - 1]);
        first += run.len();
        match run[0] {
            true => Group::observed(&name, run.len(), basis),
            false => Group::controlled(&name, run.len(), basis),
        }
    })
    .collect()
}
