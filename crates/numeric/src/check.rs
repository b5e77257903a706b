//! Argument checks: each error names the argument, its value and the requirement.
//!
//! NaN passes none of these checks.

use std::fmt;
use std::ops::RangeBounds;

/// An invalid argument.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ArgumentError {
    /// NaN or an infinity.
    NonFinite {
        /// Name of the argument.
        what: &'static str,
        /// Index of the value in an argument of several numbers, from 0.
        index: Option<usize>,
        /// NaN or the infinity.
        value: f64,
    },
    /// A finite number (or NaN) outside the range of a setting.
    OutOfRange {
        /// Name of the setting.
        what: &'static str,
        /// Value given.
        value: f64,
        /// The required range, in words.
        wanted: &'static str,
    },
}

impl fmt::Display for ArgumentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite {
                what,
                index: Some(index),
                value,
            } => write!(f, "{what}[{index}] is {value}, not a finite number"),
            Self::NonFinite {
                what,
                index: None,
                value,
            } => write!(f, "{what} is {value}, not a finite number"),
            Self::OutOfRange {
                what,
                value,
                wanted,
            } => write!(f, "{what} is {}, it must be {wanted}", Shown(*value)),
        }
    }
}

impl std::error::Error for ArgumentError {}

/// A number in a message: with an exponent if it would have many zeros.
struct Shown(f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.0;
        match value == 0.0 || !value.is_finite() || (1e-6..1e15).contains(&value.abs()) {
            true => write!(f, "{value}"),
            false => write!(f, "{value:e}"),
        }
    }
}

/// The value, if it is finite.
///
/// # Errors
/// NaN or infinity.
#[inline]
pub fn finite(what: &'static str, value: f64) -> Result<f64, ArgumentError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(ArgumentError::NonFinite {
        what,
        index: None,
        value,
    })
}

/// Passes if all values are finite.
///
/// # Errors
/// The first value that is NaN or infinite, with its index.
#[inline]
pub fn all_finite(what: &'static str, values: &[f64]) -> Result<(), ArgumentError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ArgumentError::NonFinite {
            what,
            index: Some(index),
            value: values[index],
        }),
    }
}

/// The value, if it is finite and above zero.
///
/// # Errors
/// Anything else.
#[inline]
pub fn positive(what: &'static str, value: f64) -> Result<f64, ArgumentError> {
    that(value > 0.0 && value.is_finite(), what, value, "positive")
}

/// The value, if it is finite and at least zero.
///
/// # Errors
/// Anything else.
#[inline]
pub fn non_negative(what: &'static str, value: f64) -> Result<f64, ArgumentError> {
    that(value >= 0.0 && value.is_finite(), what, value, "at least 0")
}

/// The value, if `holds` is true and it is not NaN; `wanted` is the requirement in the message.
///
/// # Errors
/// A false condition, or NaN.
#[inline]
pub fn that(
    holds: bool,
    what: &'static str,
    value: f64,
    wanted: &'static str,
) -> Result<f64, ArgumentError> {
    if holds && !value.is_nan() {
        return Ok(value);
    }
    Err(ArgumentError::OutOfRange {
        what,
        value,
        wanted,
    })
}

/// Rejects a value outside `range`, which `wanted` describes, and NaN.
///
/// # Errors
/// A value outside the range, or NaN.
#[inline]
pub fn within(
    what: &'static str,
    value: f64,
    range: impl RangeBounds<f64>,
    wanted: &'static str,
) -> Result<f64, ArgumentError> {
    that(range.contains(&value), what, value, wanted)
}

/// Applies a check of one value, such as [`positive`], to several values.
///
/// # Errors
/// The first value that the check rejects.
pub fn each(
    check: impl Fn(&'static str, f64) -> Result<f64, ArgumentError>,
    what: &'static str,
    values: &[f64],
) -> Result<(), ArgumentError> {
    values
        .iter()
        .try_for_each(|&value| check(what, value).map(|_| ()))
}
