//! The main job around a session: set-up of scene, person and arm, evaluation of touches, tables, figures.
//!
//! Not published. Composes the libraries under `crates/`.

mod board_body;
#[macro_use]
mod named;
pub mod built_in_room;
pub mod console;
pub mod corridor;
pub mod input;
pub mod job;
mod job_options;
pub mod live;
pub mod person;
pub mod recording;
pub mod report;
pub mod response;
pub mod run;
pub mod setting;

pub use console::{note, printed};
pub use input::{arms, numbers};
pub use person::training;
pub use report::figures;

use clap::Parser;
use clap::error::{ContextKind, ContextValue};
use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::num::{IntErrorKind, ParseIntError};
use std::process::ExitCode;

/// Characters kept at the beginning of a long error line (the location) and at its end (the reason), so that inputs of a
/// megabyte are not repeated.
const KEPT: [usize; 2] = [600, 300];

/// Parses the command line; exits with help, or with status 2 and an error message.
#[must_use]
pub fn arguments<A: Parser>() -> A {
    A::try_parse().unwrap_or_else(|error| in_words(error).exit())
}

/// Adds the accepted whole numbers to the error.
fn in_words(error: clap::Error) -> clap::Error {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text),
        _ => None,
    };
    let source = error.source();
    let number = source.and_then(|source| source.downcast_ref::<ParseIntError>());
    let flag_and_value = text(ContextKind::InvalidArg).zip(text(ContextKind::InvalidValue));
    let Some((number, (flag, value))) = number.zip(flag_and_value) else {
        return error;
    };
    let why = match number.kind() {
        IntErrorKind::PosOverflow => "the number is too large",
        _ => "not a whole number from 0 on",
    };
    let line = format!("invalid value '{value}' for '{flag}': {why}\n");
    clap::Error::raw(error.kind(), line)
}

/// Ends a binary: one clear line on standard error and status 2 for an error.
#[must_use]
pub fn exit(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // A reader that closes the pipe early (`| head`) is not an error.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            // Do not panic on a full device.
            let _ = writeln!(io::stderr(), "error: {}", shortened(&format!("{error:#}")));
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .any(|cause| io_kind(cause) == Some(ErrorKind::BrokenPipe))
}

/// Table writers do not expose an output error among their sources.
fn io_kind(cause: &(dyn std::error::Error + 'static)) -> Option<ErrorKind> {
    if let Some(io) = cause.downcast_ref::<io::Error>() {
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

/// The text; a very long one without its middle.
fn shortened(text: &str) -> String {
    let [first, last] = KEPT;
    let count = text.chars().count();
    if count <= first + last + 100 {
        return text.to_owned();
    }
    let beginning: String = text.chars().take(first).collect();
    let end: String = text.chars().skip(count - last).collect();
    format!(
        "{beginning} ... ({} characters) ... {end}",
        count - first - last
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: lines of a megabyte were repeated.
    #[test]
    fn error_lines_keep_the_place_and_the_reason() {
        let text = format!("a.csv line 7: {:?} is not a number", "é".repeat(1 << 20));
        let short = shortened(&text);
        assert!(short.starts_with("a.csv line 7:") && short.ends_with("is not a number"));
        assert!(short.chars().count() < 1000);
        assert_eq!(shortened("short"), "short");
    }

    /// Regression: the message was "invalid digit found in string".
    #[test]
    fn errors_say_which_whole_numbers_are_meant() {
        #[derive(Debug, Parser)]
        struct Args {
            #[arg(long, allow_negative_numbers = true)]
            seed: Option<u64>,
            #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10))]
            period_ms: Option<u32>,
        }
        let whole = "not a whole number from 0 on";
        for (words, wanted) in [
            (" --seed -1", &*format!("'-1' for '--seed <SEED>': {whole}")),
            (" --period-ms 2.5", whole),
            (" --period-ms 0", "0 is not in 1..=10"),
            (" --seed 99999999999999999999", "too large"),
            (" --sed 1", "unexpected argument"),
        ] {
            let refused = Args::try_parse_from(words.split(' ')).unwrap_err();
            let said = in_words(refused).to_string();
            assert!(said.contains(wanted), "{said}");
        }
    }
}
