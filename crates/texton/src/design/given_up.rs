//! Compromises of a design.

use crate::roughness::Quantity;

/// A compromise of a design, with its reason.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum GivenUp {
    /// Ratios are narrower than wanted, because no texture reaches them.
    #[error(
        "the ratio of roughest to smoothest is {given:.3} instead of {wanted:.3}: no texture within the limits reaches farther"
    )]
    Ratio { wanted: f64, given: f64 },
    /// Some levels lie outside the range in which the model was measured.
    #[error(
        "{levels} levels lie where the model was not measured: {what:?} is {at:.3}, measured {} to {}", range[0], range[1]
    )]
    ModelRange {
        levels: usize,
        what: Quantity,
        at: f64,
        range: [f64; 2],
    },
    /// Two levels are too close for people to tell apart.
    #[error(
        "{} and {} are only {jnd:.2} just noticeable differences apart", pair[0], pair[1]
    )]
    Step { pair: [f64; 2], jnd: f64 },
    /// Errors of printer and device exceed half of the distance between two levels.
    #[error(
        "errors of printer and device may come to {error_jnd:.2} just noticeable differences, levels are {step_jnd:.2} apart"
    )]
    Accuracy { error_jnd: f64, step_jnd: f64 },
    /// The published patch: the printer would close its gaps, or cannot make its bumps.
    #[error("the published patch: it has {is_mm:.2} mm where the printer needs {needs_mm} mm")]
    PublishedPatch { is_mm: f64, needs_mm: f64 },
    /// Certainty of the ratios: magnitudes are assumed, not measured, to grow with the model's predictions.
    #[error(
        "certainty of the ratios: magnitudes are assumed to grow as the model's predictions do; a study's table would tell"
    )]
    ScaleAssumed,
    /// Absolute magnitudes: only ratios were asked for.
    #[error("absolute magnitudes: only ratios were asked for")]
    Magnitude,
}
