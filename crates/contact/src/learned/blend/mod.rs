//! Sources of evidence, their weights, the uncertainty of their combination, and adaptation to a person's touches.

pub(super) mod adaptation;
pub(super) mod arrival;
mod calibration;
pub(super) mod combination;
pub(super) mod evidence;
pub(super) mod habit;
pub(super) mod knots;
mod lateness;
mod misses;
pub(super) mod places;
pub(super) mod sources;
pub(super) mod training;
mod turns;
