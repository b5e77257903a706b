#![doc = include_str!("../README.md")]

mod error;
mod file;
mod input;
mod message;
mod recorded;
mod recorder;
mod recorder_config;
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
pub use input::{Input, Request};
pub use recorded::Recorded;
pub use recorder::{Recorder, Summary};
pub use recorder_config::{Overflow, RecorderConfig};
pub use recording::{Inputs, Recording};
pub use replay::{Difference, Replayed, replay};
pub use setup::{ArmSource, Run, Setup};
pub use skeleton::Skeleton;
