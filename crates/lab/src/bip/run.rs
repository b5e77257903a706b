//! Runs one kind of filter over test motions, sample by sample, and keeps what it believed.

use crate::bip::published_filter::FullFilter;
use crate::bip::setup::{Mode, Setup, Trained};
use crate::bip::trajectories::{Trajectory, TrajectorySet};
use anyhow::Context;
use hwall_bip::{
    Bank, BankConfig, BipError, EnsembleConfig, EnsembleFilter, Filter, MotionFilter, Observation,
    Prior,
};
use hwall_testkit::Timing;
use serde::Serialize;
use std::time::Instant;

/// What was seen of one sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// Degrees of freedom that have a value.
    pub dofs: Vec<usize>,
    /// The values.
    pub values: Vec<f64>,
}

impl Seen {
    /// The observed part of a sample.
    fn of(row: &[Option<f64>], observed: &[usize]) -> Self {
        let present = |d: &usize| row[*d].map(|value| (*d, value));
        let (dofs, values) = observed.iter().filter_map(present).unzip();
        Self { dofs, values }
    }
}

/// Phase and phase velocity: means and covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// Mean of the phase.
    pub phase: f64,
    /// Mean of its velocity, 1/time.
    pub velocity: f64,
    /// Covariance of both.
    pub covariance: [[f64; 2]; 2],
}

/// A filter in the middle of a motion. Whatever can do this can be compared.
pub trait Runner {
    /// Lets `dt` pass, then takes what was seen.
    ///
    /// # Errors
    /// Whatever the filter says.
    fn step(&mut self, dt: f64, seen: &Seen) -> Result<(), BipError>;

    /// The phase.
    fn belief(&mut self) -> Belief;

    /// Mean and variance of all degrees of freedom at phase 1.
    ///
    /// # Errors
    /// Whatever the filter says.
    fn end(&mut self, mean: &mut [f64], variance: &mut [f64]) -> Result<(), BipError>;
}

/// A filter of the library. With `measured`, ends are those of what will be measured: with the
/// residual of held-out motions and the spread that made their intervals right.
struct Common<F> {
    filter: F,
    measured: bool,
}

impl<F: MotionFilter> Runner for Common<F> {
    fn step(&mut self, dt: f64, seen: &Seen) -> Result<(), BipError> {
        self.filter.predict(dt)?;
        self.filter
            .observe(&Observation::new(&seen.dofs, &seen.values))
    }

    fn belief(&mut self) -> Belief {
        Belief {
            phase: self.filter.phase(),
            velocity: self.filter.phase_velocity(),
            covariance: self.filter.phase_covariance(),
        }
    }

    fn end(&mut self, mean: &mut [f64], variance: &mut [f64]) -> Result<(), BipError> {
        let all: Vec<usize> = (0..mean.len()).collect();
        if self.measured {
            self.filter.predict_at(1.0, &all, mean, variance)
        } else {
            self.filter.moments_at(1.0, &all, mean, variance)
        }
    }
}

/// Noise is in the prior it was made from.
impl Runner for FullFilter {
    fn step(&mut self, dt: f64, seen: &Seen) -> Result<(), BipError> {
        FullFilter::step(self, dt, &seen.dofs, &seen.values)
    }

    fn belief(&mut self) -> Belief {
        Belief {
            phase: self.phase(),
            velocity: self.phase_velocity(),
            covariance: self.phase_covariance(),
        }
    }

    fn end(&mut self, mean: &mut [f64], variance: &mut [f64]) -> Result<(), BipError> {
        let dofs = mean.len();
        for (dof, (mean, variance)) in mean.iter_mut().zip(variance).enumerate() {
            let unknown = || BipError::UnknownDof { dof, dofs };
            *mean = self.mean_at(1.0, dof).ok_or_else(unknown)?;
            *variance = self.variance_at(1.0, dof).ok_or_else(unknown)?;
        }
        Ok(())
    }
}

/// Makes a filter that has not seen anything, as often as it is called.
type Start = Box<dyn Fn() -> Box<dyn Runner>>;

fn start(setup: &Setup, trained: &Trained) -> anyhow::Result<Start> {
    let model = &trained.model;
    let (config, measured) = (setup.filter(), setup.predicts_measurements());
    Ok(match setup.mode {
        Mode::Exact => begin(Filter::new(model, &config)?, measured),
        Mode::Bank => {
            let bank = BankConfig {
                filter: config,
                ..BankConfig::default()
            };
            begin(Bank::new(model, &bank)?, measured)
        }
        Mode::Ensemble(members) => {
            let ensemble = EnsembleConfig {
                members,
                filter: config,
                ..EnsembleConfig::default()
            };
            begin(EnsembleFilter::new(model, &ensemble)?, measured)
        }
        Mode::Compat => {
            // The default of the other filter.
            let usual = 0.01 * model.phase_velocity().mean / model.sampling_period();
            let process = setup.process_variance.unwrap_or(usual * usual);
            let prior = Prior {
                noise: trained.noise.clone(),
                ..model.to_prior()
            };
            let filter = FullFilter::new(&prior, setup.phase_variance, process)?;
            Box::new(move || Box::new(filter.clone()))
        }
    })
}

fn begin<F: MotionFilter + Clone + 'static>(filter: F, measured: bool) -> Start {
    Box::new(move || {
        let filter = filter.clone();
        Box::new(Common { filter, measured })
    })
}

/// One test motion: what the filter believed after each sample, in the layout of the JSON file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestRun {
    /// Number of the motion.
    pub id: u64,
    /// Kind of motion, where known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// Samples.
    #[serde(rename = "T")]
    pub samples: usize,
    /// Mean of the phase.
    pub phase: Vec<f64>,
    /// Mean of the phase velocity, 1/time.
    pub phase_vel: Vec<f64>,
    /// Variance of the phase.
    #[serde(rename = "P00")]
    pub phase_variance: Vec<f64>,
    /// Covariance of phase and phase velocity.
    #[serde(rename = "P01")]
    pub covariance: Vec<f64>,
    /// Variance of the phase velocity.
    #[serde(rename = "P11")]
    pub velocity_variance: Vec<f64>,
    /// All degrees of freedom at phase 1.
    #[serde(rename = "final")]
    pub end: Vec<Vec<f64>>,
    /// Their standard deviations; NaN (`null`) where the filter's variance is negative.
    #[serde(rename = "final_sd")]
    pub end_sd: Vec<Vec<f64>>,
    /// The last sample.
    #[serde(skip)]
    pub truth: Vec<Option<f64>>,
}

/// All test motions, and what they cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Runs {
    /// The motions, by number.
    pub tests: Vec<TestRun>,
    /// One prediction and one update.
    pub step: Timing,
    /// Mean and variance of all degrees of freedom at the end.
    pub query: Timing,
}

/// Filters every motion of a set, one after the other.
///
/// # Errors
/// A filter that cannot be made; a filter that fails, with the motion and the sample.
pub fn run(setup: &Setup, trained: &Trained, tests: &TrajectorySet) -> anyhow::Result<Runs> {
    let start = start(setup, trained)?;
    let (mut step_ns, mut query_ns) = (Vec::new(), Vec::new());
    let tests = tests
        .trajectories
        .iter()
        .map(|trajectory| {
            let mut runner = start();
            let mut out = TestRun::new(trajectory);
            let steps = trajectory.steps(trained.model.sampling_period());
            for (k, (row, dt)) in trajectory.rows.iter().zip(steps).enumerate() {
                let seen = Seen::of(row, &trained.observed);
                let clock = Instant::now();
                let result = runner.step(dt, &seen);
                step_ns.push(clock.elapsed().as_nanos() as f64);
                let place = || format!("{}, sample {}", trajectory.name, k + 1);
                result.with_context(place)?;
                let (mut mean, mut variance) = (vec![0.0; row.len()], vec![0.0; row.len()]);
                let clock = Instant::now();
                let result = runner.end(&mut mean, &mut variance);
                query_ns.push(clock.elapsed().as_nanos() as f64);
                result.with_context(place)?;
                out.push(runner.belief(), mean, &variance);
            }
            Ok(out)
        })
        .collect::<anyhow::Result<_>>()?;
    Ok(Runs {
        tests,
        step: Timing::from_samples_ns(step_ns),
        query: Timing::from_samples_ns(query_ns),
    })
}

impl TestRun {
    fn new(trajectory: &Trajectory) -> Self {
        let samples = trajectory.rows.len();
        Self {
            id: trajectory.id,
            kind: trajectory.kind.clone(),
            samples,
            phase: Vec::with_capacity(samples),
            phase_vel: Vec::with_capacity(samples),
            phase_variance: Vec::with_capacity(samples),
            covariance: Vec::with_capacity(samples),
            velocity_variance: Vec::with_capacity(samples),
            end: Vec::with_capacity(samples),
            end_sd: Vec::with_capacity(samples),
            truth: trajectory.rows[samples - 1].clone(),
        }
    }

    fn push(&mut self, belief: Belief, mean: Vec<f64>, variance: &[f64]) {
        let [[p00, p01], [_, p11]] = belief.covariance;
        self.phase.push(belief.phase);
        self.phase_vel.push(belief.velocity);
        self.phase_variance.push(p00);
        self.covariance.push(p01);
        self.velocity_variance.push(p11);
        self.end.push(mean);
        self.end_sd
            .push(variance.iter().map(|v| v.sqrt()).collect());
    }
}
