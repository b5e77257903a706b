//! Runs one kind of filter over test motions, sample by sample, and keeps its estimates.

use crate::bip::published_filter::FullFilter;
use crate::bip::setup::{Mode, Setup, TrainedModel};
use crate::bip::trajectories::{Trajectory, TrajectorySet};
use anyhow::Context;
use hwall_bip::{
    Bank, BankConfig, BipError, EnsembleConfig, EnsembleFilter, Filter, MotionFilter, Observation,
    Prior,
};
use hwall_testkit::Timing;
use serde::Serialize;
use std::time::Instant;

/// One test motion: the filter's estimates after each sample, in the layout of the JSON file.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TestRun {
    /// Number of the motion.
    pub id: u64,
    /// Kind of motion, if known.
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
    /// Their standard deviations; NaN (`null`) if the filter's variance is negative.
    #[serde(rename = "final_sd")]
    pub end_sd: Vec<Vec<f64>>,
    /// The last sample.
    #[serde(skip)]
    pub truth: Vec<Option<f64>>,
}

/// All test motions, and their computing time.
#[derive(Debug, Clone, PartialEq)]
pub struct Runs {
    /// The motions, by number.
    pub tests: Vec<TestRun>,
    /// One prediction and one update.
    pub step: Timing,
    /// Mean and variance of all degrees of freedom at the end.
    pub query: Timing,
}

impl Runs {
    /// The motions of a kind.
    pub fn of_kind(&self, kind: &str) -> Vec<&TestRun> {
        let own = |t: &&TestRun| t.kind.as_deref() == Some(kind);
        self.tests.iter().filter(own).collect()
    }
}

/// Filters every motion of a set, one after the other.
///
/// # Errors
/// A filter that cannot be made; a filter that fails, with the motion and the sample.
pub fn run(setup: &Setup, trained: &TrainedModel, tests: &TrajectorySet) -> anyhow::Result<Runs> {
    let (model, observed) = (&trained.model, &trained.observed);
    let (filter, measured) = (setup.filter(), setup.predicts_measurements());
    let period = model.sampling_period();
    match setup.mode {
        Mode::Exact => {
            let new = Filter::new(model, &filter)?;
            follow(|| new.clone(), measured, observed, period, tests)
        }
        Mode::Bank => {
            let nominal = BankConfig::default();
            let new = Bank::new(model, &BankConfig { filter, ..nominal })?;
            follow(|| new.clone(), measured, observed, period, tests)
        }
        Mode::Ensemble(members) => {
            let ensemble = EnsembleConfig {
                members,
                filter,
                ..EnsembleConfig::default()
            };
            let new = EnsembleFilter::new(model, &ensemble)?;
            follow(|| new.clone(), measured, observed, period, tests)
        }
        Mode::Compat => {
            // The default of the low-rank filter.
            let nominal = 0.01 * model.phase_velocity().mean / period;
            let process = setup.process_variance.unwrap_or(nominal * nominal);
            let prior = Prior {
                noise: trained.noise.clone(),
                ..model.to_prior()
            };
            let new = FullFilter::new(&prior, setup.phase_variance, process)?;
            follow(|| new.clone(), measured, observed, period, tests)
        }
    }
}

/// Filters every motion of a set; `new` gives a filter without observations, `period` is the step of a motion with one
/// sample. End points include the measurement noise if `measured`, otherwise they are of the mean motion.
///
/// # Errors
/// A filter that fails, with the motion and the sample.
pub fn follow<F: MotionFilter>(
    new: impl Fn() -> F,
    measured: bool,
    observed: &[usize],
    period: f64,
    tests: &TrajectorySet,
) -> anyhow::Result<Runs> {
    let (mut step_ns, mut query_ns) = (Vec::new(), Vec::new());
    let timed = |samples: &mut Vec<f64>, f: &mut dyn FnMut() -> Result<(), BipError>| {
        let clock = Instant::now();
        let result = f();
        samples.push(clock.elapsed().as_nanos() as f64);
        result
    };
    let mut one = |trajectory: &Trajectory| {
        let mut filter = new();
        let samples = trajectory.rows.len();
        let mut out = TestRun {
            id: trajectory.id,
            kind: trajectory.kind.clone(),
            samples,
            truth: trajectory.rows[samples - 1].clone(),
            ..TestRun::default()
        };
        let steps = trajectory.steps(period);
        for (k, (row, dt)) in trajectory.rows.iter().zip(steps).enumerate() {
            let present = |d: &usize| row[*d].map(|value| (*d, value));
            let present = observed.iter().filter_map(present);
            let (dofs, values): (Vec<usize>, Vec<f64>) = present.unzip();
            let place = || format!("{}, sample {}", trajectory.name, k + 1);
            let step = timed(&mut step_ns, &mut || {
                filter.predict(dt)?;
                filter.observe(&Observation::new(&dofs, &values))
            });
            step.with_context(place)?;
            let all: Vec<usize> = (0..row.len()).collect();
            let (mut mean, mut variance) = (vec![0.0; row.len()], vec![0.0; row.len()]);
            let end = timed(&mut query_ns, &mut || match measured {
                true => filter.predict_at(1.0, &all, &mut mean, &mut variance),
                false => filter.moments_at(1.0, &all, &mut mean, &mut variance),
            });
            end.with_context(place)?;
            let [[p00, p01], [_, p11]] = filter.phase_covariance();
            out.phase.push(filter.phase());
            out.phase_vel.push(filter.phase_velocity());
            out.phase_variance.push(p00);
            out.covariance.push(p01);
            out.velocity_variance.push(p11);
            out.end.push(mean);
            out.end_sd.push(variance.iter().map(|v| v.sqrt()).collect());
        }
        anyhow::Ok(out)
    };
    let tests: anyhow::Result<_> = tests.trajectories.iter().map(&mut one).collect();
    Ok(Runs {
        tests: tests?,
        step: Timing::from_samples_ns(step_ns),
        query: Timing::from_samples_ns(query_ns),
    })
}
