//! The main job around a session: scene, person and arm set up, touches judged, tables, figures.
//!
//! Nothing here is published. The libraries under `crates/` do the work; this composes them.

pub mod input;
pub mod live;
pub mod person;
pub mod recording;
pub mod report;
pub mod response;
pub mod run;
pub mod setting;

pub use input::{arms, numbers};
pub use person::training;
pub use report::figures;

use std::io::ErrorKind;
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
    error
        .chain()
        .any(|cause| io_kind(cause) == Some(ErrorKind::BrokenPipe))
}

/// Writers of tables keep an error of the output to themselves: it is not among their sources.
fn io_kind(cause: &(dyn std::error::Error + 'static)) -> Option<ErrorKind> {
    if let Some(io) = cause.downcast_ref::<std::io::Error>() {
        return Some(io.kind());
    }
    if let Some(json) = cause.downcast_ref::<serde_json::Error>() {
        return json.io_error_kind();
    }
    match cause.downcast_ref::<csv::Error>()?.kind() {
        csv::ErrorKind::Io(io) => Some(io.kind()),
        _ => None,
    }
}
