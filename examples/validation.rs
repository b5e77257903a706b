//! Compares with what others have published, and writes VALIDATION.md with its figures.
//!
//! `cargo run --release --example validation -- --published DIR`

use clap::Parser;
use hwall_lab::documents::{Destination, show};
use hwall_lab::validation::document::{self, Request};
use hwall_stage::exit;
use std::process::ExitCode;

/// Writes VALIDATION.md with its figures; every number in it comes from this run.
///
/// The references that it compares with lie beside the project, in ../shared, and are not part of it. Where they are missing,
/// nothing is compared or written: one line names what is missing, and the exit status is 2.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    destination: Destination,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    args.request.check()?;
    let documents = args.destination.open("out/validation")?;
    let (text, path) = document::write(&args.request, &documents)?;
    show(text, &path)
}
