//! Integration tests of the crate, one program.

mod allocation;
mod baselines;
mod common;
mod coverage_of_fusion;
mod cuts_and_points;
mod fusion;
mod fusion_answers;
mod gaze_evidence;
mod hard_recordings;
mod invariances;
mod learned;
mod learned_touches;
#[cfg(feature = "serde")]
mod model_file;
mod predict;
#[path = "../../benches/reaches/mod.rs"]
mod reaches;
mod repeats;
mod resting;
mod resting_gaze;
mod stream;
