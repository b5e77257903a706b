//! The picture of the crates and who uses whom, from their manifests.
//!
//! `cargo run --release --example architecture`, from the root of the project

use anyhow::Context;
use clap::Parser;
use hwall_lab::architecture;
use hwall_lab::documents::Destination;
use hwall_stage::exit;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Draws the crates of the workspace in layers, with an arrow from each to those it uses; writes figures/architecture/house.svg.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Root of the project
    #[arg(long, default_value = ".")]
    root: PathBuf,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let picture = architecture::svg(&architecture::read(&args.root)?)?;
    let documents = args.destination.open("out/architecture")?;
    let path = documents.figures("architecture")?.join("house.svg");
    hwall_files::write(&path, picture).with_context(|| path.display().to_string())?;
    writeln!(io::stdout(), "wrote {}", path.display()).context("standard output")
}
