//! Evenly spaced values.

use crate::error::{ReachabilityError, Result};
use hwall_numeric::check::{finite, positive, that};
use serde::{Deserialize, Serialize};

/// Maximum number of lines of a grid (about half a gigabyte of map), checked before memory is allocated.
pub(crate) const MOST_LINES: u128 = 1 << 22;

/// Evenly spaced values `first + i step`, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(f64, f64, u32)", into = "(f64, f64, u32)")]
pub struct Steps {
    first_m: f64,
    step_m: f64,
    count: u32,
}

impl Steps {
    /// `count` values from `first_m` on; a negative step counts downwards.
    ///
    /// # Errors
    /// NaN or infinity, a step of zero, no values, or more than a map can hold.
    pub fn new(first_m: f64, step_m: f64, count: usize) -> Result<Self> {
        finite("first value", first_m)?;
        finite("step", step_m)?;
        that(step_m != 0.0, "step", step_m, "anything but 0")?;
        if count == 0 {
            return Err(ReachabilityError::Empty { what: "values" });
        }
        finite("last value", first_m + step_m * count as f64)?;
        if count as u128 > MOST_LINES {
            return Err(too_many(count as u128));
        }
        Ok(Self {
            first_m,
            step_m,
            count: count as u32,
        })
    }

    /// From one end to the other, both included if the step divides the distance.
    ///
    /// # Errors
    /// NaN or infinity, a step that is not positive, or more values than a map can hold.
    pub fn spanning(from_m: f64, to_m: f64, step_m: f64) -> Result<Self> {
        positive("step", step_m)?;
        let distance = finite("to", to_m)? - finite("from", from_m)?;
        // A last step that misses the end only by rounding counts as a whole one.
        let steps = (finite("distance in steps", distance.abs() / step_m)? + 1e-9).floor();
        if steps >= MOST_LINES as f64 {
            return Err(too_many((steps as u128).saturating_add(1)));
        }
        Self::new(from_m, step_m.copysign(distance), steps as usize + 1)
    }

    /// A single value; look-ups within `tolerance_m` find it.
    ///
    /// # Errors
    /// NaN or infinity, a tolerance that is not positive.
    pub fn single(value_m: f64, tolerance_m: f64) -> Result<Self> {
        positive("tolerance of a single value", tolerance_m)?;
        Self::new(value_m, 2.0 * tolerance_m, 1)
    }

    /// Number of values.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count as usize
    }

    /// Value `index`, m.
    #[must_use]
    pub fn at(&self, index: usize) -> f64 {
        self.first_m + self.step_m * index as f64
    }

    /// All values, m.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.count()).map(|i| self.at(i))
    }

    /// Distance between neighbours, m.
    #[must_use]
    pub const fn spacing_m(&self) -> f64 {
        self.step_m.abs()
    }

    /// Integral of these samples over the steps by the trapezoidal rule; 0 for a single value.
    pub(crate) fn integral(&self, values: impl Iterator<Item = f64>) -> f64 {
        let last = self.count() - 1;
        let weighted = values.enumerate().map(|(i, value)| {
            let halves = u8::from(i > 0) + u8::from(i < last);
            0.5 * f64::from(halves) * value
        });
        weighted.sum::<f64>() * self.spacing_m()
    }

    /// Index of the nearest value; `None` if all are more than half a step away, or for NaN.
    #[inline]
    #[must_use]
    pub fn nearest(&self, value_m: f64) -> Option<usize> {
        // Truncate instead of rounding, which needs a function call without SSE 4.1; NaN fails both comparisons.
        let above = (value_m - self.first_m) / self.step_m + 0.5;
        (above >= 0.0 && above < f64::from(self.count)).then_some(above as usize)
    }
}

impl TryFrom<(f64, f64, u32)> for Steps {
    type Error = ReachabilityError;
    fn try_from((first_m, step_m, count): (f64, f64, u32)) -> Result<Self, Self::Error> {
        Self::new(first_m, step_m, count as usize)
    }
}

impl From<Steps> for (f64, f64, u32) {
    fn from(steps: Steps) -> Self {
        (steps.first_m, steps.step_m, steps.count)
    }
}

/// The error for more than [`MOST_LINES`] lines.
pub(crate) fn too_many(count: u128) -> ReachabilityError {
    ReachabilityError::TooMany {
        what: "values or lines",
        count,
        limit: MOST_LINES,
    }
}
