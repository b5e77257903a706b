//! Basis functions of the phase: values and derivatives.

use crate::error::{BipError, length};
use hwall_numeric::ArgumentError;
use hwall_numeric::check;
use hwall_numeric::dense::Matrix;
use std::fmt;

/// Larger counts are a mistake, and would take minutes to orthonormalise.
const MAX_COUNT: usize = 1024;

/// A family of functions of the phase; the motion is `0` at its start and `1` at its end.
///
/// Centres are spread evenly over `[0, 1]`, including both ends (a single one is at 0). All functions are finite at any phase in and near `[0, 1]`;
/// far outside, polynomials of degree d grow like `phase^d` and overflow only past about `1e300^(1/d)`.
///
/// Source: conventions of the published implementation, [Campbell 2017]; Legendre and Chebyshev polynomials have the argument `2 phase - 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", tag = "kind"))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[non_exhaustive]
pub enum Basis {
    /// `exp(-(phase - centre)² / (2 variance))`. On data far from zero its sum ripples, and the ripple is mistaken for phase: centre the data, or
    /// use the normalised form.
    Gaussian {
        /// Number of functions.
        count: usize,
        /// Variance of each bell, phase².
        variance: f64,
    },
    /// Gaussians divided by their sum, so that they sum to one at every phase.
    NormalizedGaussian {
        /// Number of functions.
        count: usize,
        /// Variance of each bell, phase².
        variance: f64,
    },
    /// `1 / (1 + exp(-(phase - centre) / width))`.
    Sigmoid {
        /// Number of functions.
        count: usize,
        /// Width of each step, in phase.
        width: f64,
    },
    /// `(2 phase - 1)^d`, `d = 0 .. count - 1`.
    Polynomial {
        /// Number of functions: the degree plus one.
        count: usize,
    },
    /// Legendre polynomials: nearly orthogonal on evenly spaced samples.
    Legendre {
        /// Number of functions: the degree plus one.
        count: usize,
    },
    /// Chebyshev polynomials of the first kind.
    Chebyshev {
        /// Number of functions: the degree plus one.
        count: usize,
    },
}

/// In words: `9 normalized Gaussians of variance 0.015625`.
impl fmt::Display for Basis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Gaussian { count, variance } => {
                write!(f, "{count} Gaussians of variance {variance}")
            }
            Self::NormalizedGaussian { count, variance } => {
                write!(f, "{count} normalized Gaussians of variance {variance}")
            }
            Self::Sigmoid { count, width } => write!(f, "{count} sigmoids of width {width}"),
            Self::Polynomial { count } => write!(f, "{count} powers"),
            Self::Legendre { count } => write!(f, "{count} Legendre polynomials"),
            Self::Chebyshev { count } => write!(f, "{count} Chebyshev polynomials"),
        }
    }
}

impl Basis {
    /// Gaussians whose standard deviation is the spacing of their centres.
    #[must_use]
    pub fn gaussian(count: usize) -> Self {
        Self::Gaussian {
            count,
            variance: spacing(count).powi(2),
        }
    }

    /// Normalised Gaussians whose standard deviation is the spacing of their centres.
    #[must_use]
    pub fn normalized_gaussian(count: usize) -> Self {
        Self::NormalizedGaussian {
            count,
            variance: spacing(count).powi(2),
        }
    }

    /// Number of functions.
    #[must_use]
    pub fn count(&self) -> usize {
        match *self {
            Self::Gaussian { count, .. }
            | Self::NormalizedGaussian { count, .. }
            | Self::Sigmoid { count, .. }
            | Self::Polynomial { count }
            | Self::Legendre { count }
            | Self::Chebyshev { count } => count,
        }
    }

    /// Values and derivatives of all functions at a phase, without allocation.
    ///
    /// `values`, `derivatives`: length [`count`](Self::count); derivatives per unit of phase.
    /// Error: derivatives agree with central differences to 1e-8 of the largest one.
    ///
    /// # Errors
    /// A phase that is not finite or so far out that a function overflows, a slice of wrong length, a width below 1e-6 or a variance below its
    /// square.
    pub fn evaluate_into(
        &self,
        phase: f64,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) -> Result<(), BipError> {
        self.validate()?;
        check::finite("phase", phase)?;
        length("values", self.count(), values.len())?;
        length("derivatives", self.count(), derivatives.len())?;
        self.fill(phase, values, derivatives);
        check::all_finite("values", values)
            .and_then(|()| check::all_finite("derivatives", derivatives))
            .map_err(|_| BipError::Overflow { phase })
    }

    /// Values at evenly spaced phases, one row per phase.
    pub(super) fn on_grid(&self, samples: usize) -> Matrix {
        let count = self.count();
        let mut rows = Matrix::zeros(samples, count);
        let mut derivatives = vec![0.0; count];
        for k in 0..samples {
            let phase = k as f64 / (samples - 1) as f64;
            self.fill(phase, rows.row_mut(k), &mut derivatives);
        }
        rows
    }

    /// Rejects an empty or extremely large family and too narrow functions.
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        check::that(
            (1..=MAX_COUNT).contains(&self.count()),
            "number of basis functions",
            self.count() as f64,
            "between 1 and 1024",
        )?;
        match *self {
            Self::Gaussian { variance, .. } | Self::NormalizedGaussian { variance, .. } => {
                wide_enough("variance of the basis", variance, NARROWEST * NARROWEST)
            }
            Self::Sigmoid { width, .. } => wide_enough("width of the basis", width, NARROWEST),
            Self::Polynomial { .. } | Self::Legendre { .. } | Self::Chebyshev { .. } => Ok(()),
        }
    }

    /// As [`evaluate_into`](Self::evaluate_into), without checks.
    pub(super) fn fill(&self, phase: f64, values: &mut [f64], derivatives: &mut [f64]) {
        match *self {
            Self::Gaussian { count, variance } => {
                for i in 0..count {
                    let u = phase - centre(i, count);
                    values[i] = (-0.5 * u * u / variance).exp();
                    derivatives[i] = -u / variance * values[i];
                }
            }
            Self::NormalizedGaussian { count, variance } => {
                normalized(phase, count, variance, values, derivatives);
            }
            Self::Sigmoid { count, width } => {
                for i in 0..count {
                    let u = (phase - centre(i, count)) / width;
                    values[i] = logistic(u);
                    // Not values (1 - values), which loses all digits beyond the step.
                    derivatives[i] = logistic(u) * logistic(-u) / width;
                }
            }
            Self::Polynomial { .. } => powers(2.0 * phase - 1.0, values, derivatives),
            Self::Legendre { .. } => legendre(2.0 * phase - 1.0, values, derivatives),
            Self::Chebyshev { .. } => chebyshev(2.0 * phase - 1.0, values, derivatives),
        }
    }
}

/// A narrower bell or step, in phase, falls between the samples of any recording.
const NARROWEST: f64 = 1e-6;

fn wide_enough(what: &'static str, value: f64, least: f64) -> Result<(), ArgumentError> {
    check::positive(what, value)?;
    check::that(value >= least, what, value, "at least 1e-6 phase wide")?;
    Ok(())
}

/// Distance of neighbouring centres; 1 for a single one.
fn spacing(count: usize) -> f64 {
    if count > 1 {
        1.0 / (count - 1) as f64
    } else {
        1.0
    }
}

fn centre(i: usize, count: usize) -> f64 {
    i as f64 * spacing(count)
}

fn logistic(u: f64) -> f64 {
    1.0 / (1.0 + (-u).exp())
}

/// Softmax of the exponents, shifted by the largest: the sum never vanishes, even at remote phases. With `g` the values,
/// `g_i' = g_i (c_i - Σ g_j c_j) / variance`.
fn normalized(phase: f64, count: usize, variance: f64, values: &mut [f64], slopes: &mut [f64]) {
    let nearest = (phase.clamp(0.0, 1.0) * (count - 1) as f64).round() as usize;
    let base = centre(nearest, count);
    let (mut sum, mut moment) = (0.0, 0.0);
    for (i, value) in values.iter_mut().enumerate() {
        let c = centre(i, count);
        // ((phase - c)² - (phase - base)²) without the common term phase², which may be huge.
        let excess = (base - c) * (2.0 * phase - base - c);
        *value = (-0.5 * excess / variance).exp();
        sum += *value;
        moment += *value * c;
    }
    let mean = moment / sum;
    for (i, (value, slope)) in values.iter_mut().zip(slopes).enumerate() {
        *value /= sum;
        *slope = *value * (centre(i, count) - mean) / variance;
    }
}

/// Uses a recurrence, so that `x = 0`, in the middle of the motion, is not singular.
fn powers(x: f64, values: &mut [f64], derivatives: &mut [f64]) {
    let (mut power, mut below) = (1.0, 0.0);
    for (d, (value, derivative)) in values.iter_mut().zip(derivatives).enumerate() {
        *value = power;
        *derivative = 2.0 * d as f64 * below;
        below = power;
        power *= x;
    }
}

/// `(d + 1) P_{d+1} = (2d + 1) x P_d - d P_{d-1}` and `P'_{d+1} = P'_{d-1} + (2d + 1) P_d`.
fn legendre(x: f64, values: &mut [f64], derivatives: &mut [f64]) {
    for d in 0..values.len() {
        (values[d], derivatives[d]) = match d {
            0 => (1.0, 0.0),
            1 => (x, 2.0),
            _ => {
                let n = (d - 1) as f64;
                (
                    ((2.0 * n + 1.0) * x * values[d - 1] - n * values[d - 2]) / (n + 1.0),
                    derivatives[d - 2] + 2.0 * (2.0 * n + 1.0) * values[d - 1],
                )
            }
        };
    }
}

/// `T_{d+1} = 2 x T_d - T_{d-1}`, differentiated term by term.
fn chebyshev(x: f64, values: &mut [f64], derivatives: &mut [f64]) {
    for d in 0..values.len() {
        (values[d], derivatives[d]) = match d {
            0 => (1.0, 0.0),
            1 => (x, 2.0),
            _ => (
                2.0 * x * values[d - 1] - values[d - 2],
                2.0 * x * derivatives[d - 1] + 4.0 * values[d - 1] - derivatives[d - 2],
            ),
        };
    }
}
