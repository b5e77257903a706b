//! The one error type of the crate.

use hwall_numeric::dense::{NotConverged, NotPositiveDefinite};
use hwall_numeric::{ArgumentError, check};

/// Errors in demonstrations, configurations, observations or files.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BipError {
    /// An argument is not finite or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A sample of a demonstration is NaN or infinite.
    #[error("row {row}, column {column} is {value}, not a finite number")]
    NonFiniteSample {
        /// Sample, from 0.
        row: usize,
        /// Degree of freedom, from 0.
        column: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// Time does not increase between two samples.
    #[error("row {row}: time {time} does not follow {previous}")]
    TimeNotIncreasing {
        /// The later sample, from 0.
        row: usize,
        /// Its time stamp.
        time: f64,
        /// Time stamp of the sample before.
        previous: f64,
    },
    /// A demonstration has fewer than two samples, so it has no duration.
    #[error("{samples} samples, a demonstration needs at least 2")]
    TooShort {
        /// Samples given.
        samples: usize,
    },
    /// An argument has the wrong length.
    #[error("{what} has {got} values, {expected} are expected")]
    WrongLength {
        /// The argument.
        what: &'static str,
        /// Length expected.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// The number of degrees of freedom of a demonstration differs from that of the groups.
    #[error(
        "demonstration {demonstration} has {got} degrees of freedom, the groups have {expected}"
    )]
    DofMismatch {
        /// Demonstration, from 0.
        demonstration: usize,
        /// Degrees of freedom of all groups.
        expected: usize,
        /// Degrees of freedom of the demonstration.
        got: usize,
    },
    /// The number of degrees of freedom of a component of a bank differs from that of the first.
    #[error("component {component} has {got} degrees of freedom, the first one has {expected}")]
    ComponentMismatch {
        /// Component, from 0.
        component: usize,
        /// Degrees of freedom of the first component.
        expected: usize,
        /// Degrees of freedom of this one.
        got: usize,
    },
    /// Too few demonstrations.
    #[error("{got} demonstrations, {needed} are needed")]
    TooFewDemonstrations {
        /// Demonstrations needed.
        needed: usize,
        /// Demonstrations given.
        got: usize,
    },
    /// The degrees of freedom of an onset do not move, or not faster than their noise.
    #[error("nothing moves: peak speed {peak_speed}, noise reaches {noise_speed}")]
    NothingMoves {
        /// Largest smoothed speed, in the unit of the degrees of freedom per unit of time.
        peak_speed: f64,
        /// Upper bound of the speed from noise alone.
        noise_speed: f64,
    },
    /// The trainer does not contain this demonstration, or no longer contains it.
    #[error("no demonstration with number {id}")]
    UnknownDemonstration {
        /// Its number: how many were added before it.
        id: u64,
    },
    /// The model does not have this degree of freedom.
    #[error("degree of freedom {dof} does not exist, there are {dofs}")]
    UnknownDof {
        /// Index given, from 0.
        dof: usize,
        /// Degrees of freedom of the model.
        dofs: usize,
    },
    /// A degree of freedom is listed twice.
    #[error("degree of freedom {dof} is listed twice")]
    DuplicateDof {
        /// The index, from 0.
        dof: usize,
    },
    /// A covariance is not positive definite.
    #[error("{what} is not positive definite: pivot {pivot} is {value}")]
    NotPositiveDefinite {
        /// The matrix.
        what: &'static str,
        /// Row of the first bad pivot, from 0.
        pivot: usize,
        /// The pivot.
        value: f64,
    },
    /// A basis function or its weight overflows at this phase.
    #[error("overflow at phase {phase}")]
    Overflow {
        /// The phase.
        phase: f64,
    },
    /// A model file cannot be read or written.
    #[cfg(feature = "serde")]
    #[error(transparent)]
    File(#[from] crate::model_file::ModelFileError),
    /// The functions stored for a basis are not orthonormal functions of that basis.
    #[error("the stored functions of a basis deviate from orthonormal ones by {deviation}")]
    FileBasis {
        /// Largest deviation of their Gram matrix from the identity.
        deviation: f64,
    },
    /// A singular value decomposition did not converge.
    #[error("the singular values of a {rows} x {columns} matrix did not converge")]
    NotConverged {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
}

impl BipError {
    /// Names the matrix that has no Cholesky factor.
    pub(crate) fn indefinite(what: &'static str) -> impl Fn(NotPositiveDefinite) -> Self {
        move |e| Self::NotPositiveDefinite {
            what,
            pivot: e.pivot,
            value: e.value,
        }
    }
}

impl From<NotConverged> for BipError {
    fn from(e: NotConverged) -> Self {
        Self::NotConverged {
            rows: e.rows,
            columns: e.columns,
        }
    }
}

/// Rejects an unexpected length.
pub(crate) fn length(what: &'static str, expected: usize, got: usize) -> Result<(), BipError> {
    if expected == got {
        Ok(())
    } else {
        Err(BipError::WrongLength {
            what,
            expected,
            got,
        })
    }
}

/// A request for values at a phase: the phase is finite, the degrees of freedom exist, and there is a place for each mean.
pub(crate) fn check_request(
    phase: f64,
    dofs: &[usize],
    count: usize,
    mean: &[f64],
) -> Result<(), BipError> {
    check::finite("phase", phase)?;
    length("mean", dofs.len(), mean.len())?;
    match dofs.iter().find(|d| **d >= count) {
        None => Ok(()),
        Some(&dof) => Err(BipError::UnknownDof { dof, dofs: count }),
    }
}
