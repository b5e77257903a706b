//! Where a hand will touch: estimators, and what the scene adds.

pub mod estimators;
pub mod fusion;
