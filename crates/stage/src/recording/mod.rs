//! Recordings of the main job and of live sessions: their setup data, and replay.

mod replay;
mod rerun;
pub(crate) mod runs;
mod setup;
mod start;
pub(crate) mod words;

pub use replay::replay;
pub use rerun::Rebuilt;
pub use runs::run_of;
pub use setup::SessionSource;
pub use start::{finish, of_stage, planned, start, urdf_beside};
