//! The main job around a session: scene, person and arm set up, touches judged, tables, figures.
//!
//! Nothing here is published. The libraries under `crates/` do the work; this composes them.

pub mod input;
pub mod live;
pub mod person;
pub mod report;
pub mod run;
pub mod setting;

pub use input::{arms, numbers};
pub use person::training;
pub use report::figures;

use std::process::ExitCode;

/// Ends a binary: one clear line on standard error and status 2 for an error.
#[must_use]
pub fn exit(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // A reader that closes the pipe early (`| head`) has what it wanted.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>();
        io.is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
    })
}
