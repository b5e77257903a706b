//! Warnings in words.

use super::numbers::probability;
use crate::analysis::Warning;
use std::fmt::{self, Display};

impl Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Skewed { skewness } => write!(
                f,
                "residuals are skewed ({skewness:.2}), aligned ranks find effects that are not there"
            ),
            Self::Discrete {
                distinct, values, ..
            } => write!(
                f,
                "{values} values are only {distinct} different ones, aligned ranks find effects that are not there"
            ),
            Self::NotNormal { p } => {
                write!(
                    f,
                    "residuals are not normal (p = {})",
                    probability(Some(*p))
                )
            }
            Self::NotSpherical { effect, p, gg } => write!(
                f,
                "{effect} is not spherical (Mauchly's p = {}), read its corrected p (GG ε = {gg:.3})",
                probability(Some(*p))
            ),
            Self::PooledUnequal { ratio } => write!(
                f,
                "the errors that are pooled differ {ratio:.1} times in mean square, p of the noisier effects is too small"
            ),
        }
    }
}
