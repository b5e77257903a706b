#![doc = include_str!("../README.md")]

mod axes;
mod calibration;
mod deterministic;
mod error;
mod estimate;
mod frame;
mod freeze;
mod gaze;
mod labelled;
mod predict;
mod recording;
mod recording_csv;
mod resample;
mod segment;
mod steady;
mod tracking;

pub use axes::{RIGID_TOLERANCE, RigidMap};
pub use calibration::Calibration;
pub use deterministic::{DeterministicPredictor, PredictorConfig};
pub use error::ContactError;
pub use estimate::{ContactEstimate, ContactEstimator, TimeToContact};
pub use frame::{GazeRay, HandFrame, HandPoint, MAX_COORDINATE_M};
pub use freeze::{FreezeConfig, FreezeKind};
pub use gaze::GazeFilter;
pub use labelled::LabelledReach;
pub use predict::{ContactPrediction, PredictionSource, Predictor, Seen};
pub use recording::{Quantity, Recording, Sample};
pub use recording_csv::{read_recordings, write_recordings};
pub use segment::{Reach, ReachEnd, SegmentConfig, reaches};
pub use steady::SteadyPoint;
pub use tracking::{HandFilter, HandFilterConfig, HandState, LostReason, Tracking};
