//! Interaction primitives: learnt from demonstrations, they predict the rest of a motion, with intervals.

use crate::arrays::{Array, Floats, Rows, array, in_order, like, tuple};
use crate::error::{Error, OrRaise, one_of, refuse};
use hwall::bip::{
    Bank, BankConfig, Basis, BipError, Demonstration, FilterConfig, Group, Model, NoiseSource,
    Observation, TrainingConfig, TuningConfig, tune,
};
use hwall::numeric::check::{all_finite, that};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};

/// Writes a text, all or nothing.
pub(crate) fn write(path: &Path, text: &str) -> PyResult<()> {
    let told = |error| Error::new_err(format!("{}: {error}", path.display()));
    hwall_files::write(path, text).map_err(told)
}

/// Reads a text.
pub(crate) fn read(path: &Path) -> PyResult<String> {
    let told = |error| Error::new_err(format!("{}: {error}", path.display()));
    std::fs::read_to_string(path).map_err(told)
}

fn basis_of(name: &str, count: usize) -> PyResult<Basis> {
    let known = [
        ("legendre", Basis::Legendre { count }),
        ("polynomial", Basis::Polynomial { count }),
        ("chebyshev", Basis::Chebyshev { count }),
        ("gaussian", Basis::gaussian(count)),
        ("normalized_gaussian", Basis::normalized_gaussian(count)),
    ];
    one_of("basis", name, &known)
}

/// The standard normal quantile at `p`, by Python's own library.
fn normal_quantile(py: Python<'_>, p: f64) -> PyResult<f64> {
    let normal = py.import("statistics")?.getattr("NormalDist")?.call0()?;
    normal.call_method1("inv_cdf", (p,))?.extract()
}

/// Neighbouring columns that are all observed, or all not, form a group.
fn groups(observed: &[bool], basis: Basis) -> Vec<Group> {
    let runs = observed.chunk_by(|a, b| a == b).enumerate();
    let group = |(number, run): (usize, &[bool])| {
        let make = if run[0] {
            Group::observed
        } else {
            Group::controlled
        };
        make(&format!("group {number}"), run.len(), basis)
    };
    runs.map(group).collect()
}

/// Learns a model from demonstrations: a list of arrays (samples, columns) of any length and unit.
///
/// `observed`: the columns that a filter will see; the others are inferred. Default: all. Time: `times`, a list of arrays
/// (samples,), or `period` between samples; filters use the same unit. `tune`: choose the noise on held-out
/// motions, so that intervals have their stated coverage (a second for 47 demonstrations of 25 columns). `published`: the conventions
/// of IntPrim, to compare with it: no centring, and a phase velocity of 1 / samples.
#[pyfunction]
#[pyo3(signature = (
    demonstrations, observed=None, *, period=1.0, times=None, basis="legendre", functions=8, tune=true, published=false
))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn fit(
    py: Python<'_>,
    demonstrations: Vec<Floats<'_>>,
    observed: Option<Vec<usize>>,
    period: f64,
    times: Option<Vec<Floats<'_>>>,
    basis: &str,
    functions: usize,
    tune: bool,
    published: bool,
) -> PyResult<PyModel> {
    let mut motions = Vec::new();
    if let Some(times) = times
        .as_ref()
        .filter(|times| times.len() != demonstrations.len())
    {
        return refuse(format!(
            "{} demonstrations and {} times",
            demonstrations.len(),
            times.len()
        ));
    }
    for (number, values) in demonstrations.iter().enumerate() {
        let &[_, columns] = values.shape() else {
            let shape = tuple(values.shape());
            return refuse(format!(
                "demonstration {number} has the shape {shape}, it must be (samples, columns)"
            ));
        };
        let values = in_order(values).into_owned();
        let motion = match &times {
            None => Demonstration::from_samples(period, columns, values),
            Some(times) => Demonstration::from_timestamps(
                in_order(&times[number]).into_owned(),
                columns,
                values,
            ),
        };
        motions.push(motion.or_raise_in_row(number)?);
    }
    let Some(columns) = motions.first().map(Demonstration::dofs) else {
        let (got, needed) = (0, if tune { 3 } else { 1 });
        return Err(BipError::TooFewDemonstrations { got, needed }).or_raise();
    };
    let mut seen = vec![observed.is_none(); columns];
    for column in observed.unwrap_or_default() {
        match seen.get_mut(column) {
            Some(seen) => *seen = true,
            None => return refuse(format!("there is no column {column} among {columns}")),
        }
    }
    let groups = groups(&seen, basis_of(basis, functions)?);
    let config = match published {
        true => TrainingConfig::published(groups),
        false => TrainingConfig::new(groups),
    };
    let model = py.detach(|| match tune {
        true => tuned(&motions, &config),
        false => Model::train(&motions, &config),
    });
    PyModel::of(model.or_raise()?)
}

fn tuned(motions: &[Demonstration], config: &TrainingConfig) -> Result<Model, BipError> {
    Ok(tune(motions, config, &TuningConfig::new(config))?.model)
}

/// One hypothesis and the noise of the fit; the variance of the phase's acceleration is 1e-8 per sample.
fn as_published(period: f64) -> BankConfig {
    BankConfig {
        filter: FilterConfig {
            acceleration_variance: Some(1e-8 / period.powi(4)),
            noise: NoiseSource::Fit,
            noise_factor: Some(1.0),
            correlation_time: Some(0.0),
            ..FilterConfig::default()
        },
        split_velocity: false,
        pauses: 0.0,
        changes: 0.0,
        not_begun: 0.0,
        under_way: 0.0,
        hypotheses: 1,
        ..BankConfig::default()
    }
}

/// Reads a model written by `save`.
#[pyfunction]
pub(crate) fn load(path: PathBuf) -> PyResult<PyModel> {
    PyModel::of(Model::from_json(&read(&path)?).or_raise()?)
}

/// A learnt motion, immutable.
#[pyclass(frozen, module = "hwall.bip", name = "Model")]
pub(crate) struct PyModel {
    model: Model,
    seen: Vec<usize>,
}

impl PyModel {
    fn of(model: Model) -> PyResult<Self> {
        let roles = model
            .groups()
            .iter()
            .flat_map(|group| vec![group.role; group.dofs]);
        let seen = roles
            .enumerate()
            .filter(|(_, role)| *role != hwall::bip::Role::Controlled);
        Ok(Self {
            seen: seen.map(|(column, _)| column).collect(),
            model,
        })
    }
}

#[pymethods]
impl PyModel {
    /// A filter for a new motion. `published`: the extended Kalman filter of IntPrim, to compare with it: one hypothesis, so no pauses,
    /// changes of intention, late starts and outliers, and the noise of the fit.
    #[pyo3(signature = (published=false))]
    fn filter(&self, published: bool) -> PyResult<Filter> {
        let config = match published {
            true => as_published(self.model.sampling_period()),
            false => BankConfig::default(),
        };
        Ok(Filter {
            bank: Bank::new(&self.model, &config).or_raise()?,
            seen: self.seen.clone(),
            columns: self.model.dofs(),
            period: self.model.sampling_period(),
        })
    }

    /// Mean of all columns at phases from 0 (start) to 1 (end): (columns,) of a number, (n, columns) of (n,).
    fn mean<'py>(&self, py: Python<'py>, phase: Floats<'py>) -> PyResult<Array<'py>> {
        let (rows, columns) = (Rows::new("phase", &phase, &[])?, self.model.dofs());
        let mut means = vec![0.0; columns * rows.count];
        for (mean, &phase) in means.chunks_mut(columns).zip(rows.values()) {
            self.model.mean_at(phase, mean).or_raise()?;
        }
        like(py, &rows, means, &[columns])
    }

    /// Number of columns.
    #[getter]
    fn columns(&self) -> usize {
        self.model.dofs()
    }

    /// The columns that a filter sees.
    #[getter]
    fn observed(&self) -> Vec<usize> {
        self.seen.clone()
    }

    /// Number of training demonstrations.
    #[getter]
    fn demonstrations(&self) -> usize {
        self.model.demonstrations()
    }

    /// Writes the model as JSON, with its tuning.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write(&path, &self.model.to_json())
    }

    fn __repr__(&self) -> String {
        let (columns, from) = (self.model.dofs(), self.model.demonstrations());
        format!("<hwall.bip.Model of {columns} columns from {from} demonstrations>")
    }
}

/// Tracks a motion sample by sample; handles pauses, late starts, changes of intention and outliers.
#[pyclass(module = "hwall.bip")]
pub(crate) struct Filter {
    bank: Bank,
    seen: Vec<usize>,
    columns: usize,
    period: f64,
}

/// Predicted measurement at a phase, with its interval of the requested probability.
#[pyclass(frozen, get_all, module = "hwall.bip")]
pub(crate) struct Prediction {
    /// Mean of every column, (columns,) or (n, columns).
    mean: Py<PyArrayDyn<f64>>,
    /// Standard deviation, same shape.
    sd: Py<PyArrayDyn<f64>>,
    /// Lower end of the interval, same shape.
    low: Py<PyArrayDyn<f64>>,
    /// Upper end of the interval, same shape.
    high: Py<PyArrayDyn<f64>>,
}

#[pymethods]
impl Filter {
    /// Takes a sample `x`, (observed columns,), `dt` after the previous one (default: the period of the demonstrations).
    /// `columns`: the columns in `x`, if not the observed ones. NaN is an error: leave out missing values. An
    /// error leaves the filter unchanged. True if the sample fits, False if it was rejected as an outlier.
    #[pyo3(signature = (x, dt=None, columns=None))]
    fn update(
        &mut self,
        x: Floats<'_>,
        dt: Option<f64>,
        columns: Option<Vec<usize>>,
    ) -> PyResult<bool> {
        let columns = columns.as_deref().unwrap_or(&self.seen);
        let values = in_order(&x);
        if x.ndim() > 1 || values.len() != columns.len() {
            return refuse(format!(
                "x has the shape {}, it must be ({},)",
                tuple(x.shape()),
                columns.len()
            ));
        }
        all_finite("x", &values).or_raise()?;
        if let Some(column) = columns.iter().find(|column| **column >= self.columns) {
            return refuse(format!(
                "there is no column {column} among {}",
                self.columns
            ));
        }
        self.bank.predict(dt.unwrap_or(self.period)).or_raise()?;
        let update = self
            .bank
            .observe(&Observation::new(columns, &values))
            .or_raise()?;
        Ok(update.gated == 0)
    }

    /// Adds knowledge about the end (or another phase): values `x` of `columns`, with their standard deviation `sd`.
    #[pyo3(signature = (x, sd, columns, phase=1.0))]
    fn observe_at(
        &mut self,
        x: Floats<'_>,
        sd: f64,
        columns: Vec<usize>,
        phase: f64,
    ) -> PyResult<()> {
        let values = in_order(&x);
        let variances = vec![sd * sd; values.len()];
        let observation = Observation::new(&columns, &values).with_variances(&variances);
        self.bank.observe_at(phase, &observation).or_raise()?;
        Ok(())
    }

    /// Predicted measurement at a phase (1: the end), in all columns; `level`: probability of the interval. Arrays are
    /// (columns,) for a number, (n, columns) for phases (n,).
    #[pyo3(signature = (phase=None, level=0.9))]
    fn predict<'py>(
        &mut self,
        py: Python<'py>,
        phase: Option<Floats<'py>>,
        level: f64,
    ) -> PyResult<Prediction> {
        that(
            level > 0.0 && level < 1.0,
            "level",
            level,
            "above 0 and below 1",
        )
        .or_raise()?;
        let rows = match &phase {
            None => Rows::one(1.0),
            Some(phase) => Rows::new("phase", phase, &[])?,
        };
        let columns = self.columns;
        let all: Vec<usize> = (0..columns).collect();
        let (mut mean, mut sd) = (
            vec![0.0; columns * rows.count],
            vec![0.0; columns * rows.count],
        );
        for (row, &phase) in rows.values().iter().enumerate() {
            let at = row * columns..(row + 1) * columns;
            self.bank
                .predict_at(phase, &all, &mut mean[at.clone()], &mut sd[at])
                .or_raise()?;
        }
        sd.iter_mut()
            .for_each(|variance| *variance = variance.sqrt());
        let z = normal_quantile(py, 0.5 + 0.5 * level)?;
        let end = |sign: f64| {
            mean.iter()
                .zip(&sd)
                .map(|(mean, sd)| mean + sign * z * sd)
                .collect()
        };
        let (low, high) = (end(-1.0), end(1.0));
        Ok(Prediction {
            mean: like(py, &rows, mean, &[columns])?.unbind(),
            sd: like(py, &rows, sd, &[columns])?.unbind(),
            low: like(py, &rows, low, &[columns])?.unbind(),
            high: like(py, &rows, high, &[columns])?.unbind(),
        })
    }

    /// Elapsed share of the motion.
    #[getter]
    fn phase(&self) -> f64 {
        self.bank.phase()
    }

    /// Standard deviation of the phase.
    #[getter]
    fn phase_sd(&mut self) -> f64 {
        self.bank.phase_covariance()[0][0].sqrt()
    }

    /// Time until the end: mean and standard deviation; None if the motion seems to have stopped.
    #[getter]
    fn time_to_end(&mut self) -> Option<(f64, f64)> {
        self.bank.time_to_end().map(|time| (time.mean, time.sd))
    }

    /// Probability that the motion is at rest.
    #[getter]
    fn resting(&self) -> f64 {
        self.bank.resting()
    }

    /// Log likelihood of all samples so far.
    #[getter]
    fn log_likelihood(&self) -> f64 {
        self.bank.health().log_likelihood
    }

    /// Hypotheses, with probabilities that sum to 1: (n, 3) of probability, phase, phase velocity.
    #[getter]
    fn hypotheses<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let all = self.bank.hypotheses();
        let values: Vec<f64> = all
            .flat_map(|h| [h.probability, h.phase, h.phase_velocity])
            .collect();
        let count = values.len() / 3;
        array(py, values, &[count, 3])
    }
}
