//! Compares with what others have published, and writes VALIDATION.md with its figures.
//!
//! `cargo run --release --example validation -- --published DIR`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::reach::published;
use hwall_lab::validation::document::{self, Request};
use hwall_stage::exit;
use hwall_stage::numbers::count_within;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Writes VALIDATION.md with its figures; every number in it comes from this run.
///
/// The references that it compares with lie beside the project, in ../shared, and are not part of it. Where they are missing,
/// nothing is compared or written: one line names what is missing, and the exit status is 2.
#[derive(Parser)]
struct Args {
    /// Folder with ori_1.txt .. ori_7.txt, the maps published with the 2018 paper
    #[arg(long, default_value = published::FOLDER)]
    published: PathBuf,
    /// Folder with the reference runs of Bayesian Interaction Primitives and their workload
    #[arg(long, default_value = "../shared/reference/bip")]
    bip: PathBuf,
    /// Folder with reference numbers of textures
    #[arg(long, default_value = "../shared/reference/texton")]
    texton: PathBuf,
    /// Folder with reference studies and their analyses
    #[arg(long, default_value = "../shared/reference/psychophysics")]
    psychophysics: PathBuf,
    #[command(flatten)]
    destination: Destination,
    /// Seed of the random poses
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Random poses
    #[arg(long, default_value_t = 10_000_000, value_parser = count_within::<1, 1_000_000_000>, allow_negative_numbers = true)]
    poses: usize,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let request = Request {
        published: &args.published,
        bip: &args.bip,
        texton: &args.texton,
        psychophysics: &args.psychophysics,
        seed: args.seed,
        poses: args.poses,
    };
    request.check()?;
    let documents = args.destination.open("out/validation")?;
    let written = document::write(&request, &documents)?;
    let (text, path) = (written.text, written.path.display());
    writeln!(io::stdout(), "{text}\nwrote {path}").context("standard output")
}
