//! Recordings of the main job and of live sessions: what is written beside the messages, and the way back.

mod replay;
mod rerun;
mod setup;
mod start;

pub use replay::replay;
pub use rerun::Rebuilt;
pub use setup::{SessionSource, run_of};
pub use start::{finish, of_stage, planned, start, urdf_beside};
