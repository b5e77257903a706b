//! Sampled orientations of maps, and the nearest one.

use crate::angle::wrapped_rad;
use crate::error::Result;
use hwall_numeric::check::{finite, positive, that};
use std::f64::consts::PI;

/// Sampled headings of a wall's normal in the base frame: all multiples of a step, up to an end on both sides of 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledOrientations {
    step_rad: f64,
    /// Multiples of the step on each side.
    each_side: f64,
}

/// A heading and the sampled one nearest to it. `heading_rad + turn_rad` is the requested heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapped {
    /// The sampled heading, rad.
    pub heading_rad: f64,
    /// Turn from the sampled to the requested heading, rad, in `(-π, π]`. The avatar must turn by this
    /// (counter-clockwise from above) for the wall to appear at the sampled heading.
    pub turn_rad: f64,
    /// Is the heading at most half a step away? Otherwise it lies beyond the last sampled one.
    pub sampled: bool,
}

impl Default for SampledOrientations {
    /// 22.5 degrees apart, up to 45 degrees.
    fn default() -> Self {
        Self {
            step_rad: PI / 8.0,
            each_side: 2.0,
        }
    }
}

impl SampledOrientations {
    /// Multiples of `step_rad` (above 0, at most half a turn) up to `end_rad` (0 to π).
    ///
    /// # Errors
    /// A step or an end outside its range, NaN.
    pub fn new(step_rad: f64, end_rad: f64) -> Result<Self> {
        positive("step_rad", step_rad)?;
        that(
            (1e-6..=PI).contains(&step_rad),
            "step_rad",
            step_rad,
            "1e-6 to half a turn",
        )?;
        that(
            (0.0..=PI).contains(&end_rad),
            "end_rad",
            end_rad,
            "0 to half a turn",
        )?;
        // An end that is a multiple up to rounding is included.
        let each_side = (end_rad / step_rad + 1e-9).floor();
        Ok(Self {
            step_rad,
            each_side,
        })
    }

    /// The seven orientations of the published maps: 15 degrees apart, up to 45 degrees ([H-Wall], IV.8).
    #[must_use]
    pub fn dissertation() -> Self {
        Self {
            step_rad: PI / 12.0,
            each_side: 3.0,
        }
    }

    /// Distance between neighbours, rad.
    #[must_use]
    pub const fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// The last one on each side, rad.
    #[must_use]
    pub fn end_rad(&self) -> f64 {
        self.each_side * self.step_rad
    }

    /// The sampled heading nearest to a heading of a wall's normal in the base frame, rad; on ties, the
    /// one farther from 0.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn snap(&self, heading_rad: f64) -> Result<Snapped> {
        let heading = wrapped_rad(finite("heading_rad", heading_rad)?);
        let nearest = (heading / self.step_rad)
            .round()
            .min(self.each_side)
            .max(-self.each_side);
        let snapped = nearest * self.step_rad;
        let turn_rad = wrapped_rad(heading - snapped);
        Ok(Snapped {
            heading_rad: snapped,
            turn_rad,
            sampled: turn_rad.abs() <= 0.5 * self.step_rad + 1e-12,
        })
    }
}
