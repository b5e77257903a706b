#![doc = include_str!("../README.md")]

mod body_point;
mod error;
mod frame;
mod hand_point;
mod noise;
pub mod reach;
pub mod recording;
mod rigid_fit;
pub mod track;

pub use body_point::{BodyPoint, NamedPoint};
pub use error::HandError;
pub use frame::{Bystanders, GazeRay, HandFrame, MAX_COORDINATE_M, MOST_BYSTANDERS, TrackedPoint};
pub use glam;
pub use hand_point::HandPoint;
pub use hwall_geometry::{self, Pose};
pub use hwall_numeric::ArgumentError;
pub use reach::{
    LabelConfig, Labelled, LabelledReach, LeftOut, Reach, ReachCut, ReachEnd, ReachOnset,
    ReachWatch, SegmentConfig, WatchConfig, WatchUpdate, labelled_reaches, reaches,
};
pub use recording::{Quantity, Recording, Sample, UnitHint, read_recordings, write_recordings};
pub use rigid_fit::{PointPair, RigidFit};
pub use track::{
    Fixation, FreezeConfig, FreezeKind, Gaze, GazeFilter, GazeFilterConfig, HandFilter,
    HandFilterConfig, HandState, LostReason, Tracking,
};
