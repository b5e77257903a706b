//! The arm's side of a session: states in, commands out.

mod commands;
mod edge;
mod safety;
mod state;

pub use commands::{Control, MovingSurface};
pub(super) use safety::Safety;
pub use state::SessionState;
