//! A ratio of variances whose denominator may be zero.

use serde::{Serialize, Serializer};
use std::fmt;

/// An F or t ratio; its denominator, the error, is zero for perfect data.
///
/// In JSON a number, `"infinite"` or `"undefined"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ratio {
    /// The normal case.
    Finite(f64),
    /// An effect without any error.
    Infinite,
    /// Neither effect nor error.
    Undefined,
}

impl Ratio {
    /// `effect / error`; both must be exactly zero if they vanish.
    pub(super) fn of(effect: f64, error: f64) -> Self {
        if error != 0.0 {
            Self::Finite(effect / error)
        } else if effect != 0.0 {
            Self::Infinite
        } else {
            Self::Undefined
        }
    }

    /// The number, if there is one.
    #[must_use]
    pub const fn finite(self) -> Option<f64> {
        match self {
            Self::Finite(value) => Some(value),
            Self::Infinite | Self::Undefined => None,
        }
    }

    /// The tail probability of the ratio: 0 at infinity, `None` if it is undefined.
    pub(super) fn tail(self, tail: impl Fn(f64) -> f64) -> Option<f64> {
        match self {
            Self::Finite(value) => Some(tail(value)),
            Self::Infinite => Some(0.0),
            Self::Undefined => None,
        }
    }
}

impl fmt::Display for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Finite(value) => value.fmt(f),
            Self::Infinite => f.pad("infinite"),
            Self::Undefined => f.pad("undefined"),
        }
    }
}

impl Serialize for Ratio {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Finite(value) => serializer.serialize_f64(*value),
            Self::Infinite => serializer.serialize_str("infinite"),
            Self::Undefined => serializer.serialize_str("undefined"),
        }
    }
}
