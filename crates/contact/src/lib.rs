#![doc = include_str!("../README.md")]

mod axes;
mod baseline;
mod baseline_minimum_jerk;
mod baseline_neighbour;
mod baseline_ridge;
mod calibration;
mod error;
mod estimate;
mod frame;
mod freeze;
mod gaze;
mod label;
mod labelled;
mod predict;
mod recording;
mod recording_csv;
mod resample;
mod segment;
mod steady;
mod tracking;

pub use axes::{RIGID_TOLERANCE, RigidMap};
pub use baseline::{ConstantVelocity, Hold};
pub use baseline_minimum_jerk::MinimumJerk;
pub use baseline_neighbour::NearestNeighbour;
pub use baseline_ridge::RidgeWindow;
pub use calibration::Calibration;
pub use error::ContactError;
pub use estimate::{ContactEstimate, ContactEstimator, TimeToContact};
pub use frame::{GazeRay, HandFrame, HandPoint, MAX_COORDINATE_M};
pub use freeze::{FreezeConfig, FreezeKind};
pub use gaze::GazeFilter;
pub use label::{LabelConfig, Labelled, LeftOut, ReachCut, labelled_reaches};
pub use labelled::LabelledReach;
pub use predict::{
    ContactPrediction, DeterministicPredictor, PredictionSource, Predictor, PredictorConfig,
};
pub use recording::{Quantity, Recording, Sample};
pub use recording_csv::{read_recordings, write_recordings};
pub use segment::{Reach, ReachEnd, SegmentConfig, reaches};
pub use steady::SteadyPoint;
pub use tracking::{HandFilter, HandFilterConfig, HandState, LostReason, Tracking};
