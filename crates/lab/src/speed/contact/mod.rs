//! Where a hand will touch: estimators, their knobs, and what the scene adds.

pub mod estimators;
pub mod fusion;
pub mod knobs;
