//! The one error type of the crate.

use hwall_hand::HandError;
use hwall_numeric::ArgumentError;

/// Errors in training reaches, model files or configurations.
///
/// A hand that approaches nothing is not an error: see [`Predictor`](crate::Predictor).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// An argument is not finite or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A labelled reach cannot be learned from, or a setting of a filter is out of range.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// Too few training reaches.
    #[error("{got} reaches, at least {needed} are needed")]
    TooFewReaches {
        /// How many there are.
        got: usize,
        /// How many there must be.
        needed: usize,
    },
    /// The normal equations of a regression are singular or not finite.
    #[error("normal equations of size {size} cannot be solved")]
    Singular {
        /// Number of coefficients.
        size: usize,
    },
    /// The interaction primitive cannot be trained, read or run.
    #[error(transparent)]
    Primitive(#[from] hwall_bip::BipError),
    /// A model file cannot be read or written.
    #[cfg(feature = "serde")]
    #[error(transparent)]
    File(#[from] hwall_bip::model_file::ModelFileError),
    /// The length of a list does not match the rest of the model file.
    #[cfg(feature = "serde")]
    #[error("{what} has {got} entries, it must have {expected}")]
    FileLength {
        /// Name of the list.
        what: &'static str,
        /// Entries it must have.
        expected: usize,
        /// Entries it has.
        got: usize,
    },
}
