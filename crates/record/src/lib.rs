#![doc = include_str!("../README.md")]

mod error;
mod file;
mod message;
mod recorded;
mod recorder;
mod recording;
mod replay;
mod schema;
mod setup;
mod skeleton;
mod urdf;
mod view;
mod writer;

pub use error::RecordError;
pub use file::Ending;
pub use recorded::Recorded;
pub use recorder::{Overflow, Recorder, RecorderConfig, Summary};
pub use recording::{Input, Inputs, Recording, Request};
pub use replay::{Difference, Replayed, replay};
pub use setup::{ArmSource, Run, Setup};
pub use skeleton::Skeleton;
