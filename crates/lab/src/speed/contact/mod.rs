//! Contact prediction: estimators, and fusion with the scene.

pub mod estimators;
pub mod fusion;
