//! What a design could not keep.

use crate::roughness::Quantity;
use std::fmt;

/// Something that a design gave up, with its reason.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum GivenUp {
    /// Ratios are narrower than was wanted, as no texture reaches so far.
    Ratio {
        /// Roughest to smoothest, wanted.
        wanted: f64,
        /// The same as it is.
        given: f64,
    },
    /// Some levels lie outside the range in which the model was measured.
    ModelRange {
        /// How many.
        levels: usize,
        /// What leaves the range.
        what: Quantity,
        /// Its value farthest out.
        at: f64,
        /// The range.
        range: [f64; 2],
    },
    /// Two levels are nearer to each other than people can tell.
    Step {
        /// The two, as they were wanted.
        pair: [f64; 2],
        /// Their distance in just noticeable differences.
        jnd: f64,
    },
    /// Errors of printer and device come to more than half of the distance between two levels.
    Accuracy {
        /// Largest error, in just noticeable differences.
        error_jnd: f64,
        /// Least distance, in just noticeable differences.
        step_jnd: f64,
    },
    /// The published patch: the printer closes its gaps, or cannot make its bumps.
    PublishedPatch {
        /// Gap, or breadth or height of a bump, of the published patch, mm.
        is_mm: f64,
        /// What the printer needs, mm.
        needs_mm: f64,
    },
    /// That magnitudes grow as the model's predictions do is an assumption, not a finding.
    ScaleAssumed,
    /// Absolute magnitudes: only ratios were asked for.
    Magnitude,
}

impl fmt::Display for GivenUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ratio { wanted, given } => write!(
                f,
                "the ratio of roughest to smoothest is {given:.3} instead of {wanted:.3}: no texture within the limits reaches farther"
            ),
            Self::ModelRange {
                levels,
                what,
                at,
                range: [low, high],
            } => write!(
                f,
                "{levels} levels lie where the model was not measured: {what:?} is {at:.3}, measured {low} to {high}"
            ),
            Self::Step { pair: [a, b], jnd } => write!(
                f,
                "{a} and {b} are only {jnd:.2} just noticeable differences apart"
            ),
            Self::Accuracy {
                error_jnd,
                step_jnd,
            } => write!(
                f,
                "errors of printer and device may come to {error_jnd:.2} just noticeable differences, levels are {step_jnd:.2} apart"
            ),
            Self::PublishedPatch { is_mm, needs_mm } => write!(
                f,
                "the published patch: it has {is_mm:.2} mm where the printer needs {needs_mm} mm"
            ),
            Self::ScaleAssumed => write!(
                f,
                "certainty of the ratios: magnitudes are assumed to grow as the model's predictions do; a study's table would tell"
            ),
            Self::Magnitude => write!(f, "absolute magnitudes: only ratios were asked for"),
        }
    }
}
