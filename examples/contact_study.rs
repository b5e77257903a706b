//! Where will a hand touch, seen from the beginning of its reach? Every estimator on held-out reaches.
//!
//! `cargo run --release --example contact_study -- --recordings DIR --out DIR`

use anyhow::Context;
use clap::Parser;
use hwall_examples::{contact_candidates, contact_report, exit};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares estimators of where and when a hand touches, on reaches that they were not trained with.
///
/// Recordings are CSV files, one row a sample, metres and seconds: t, columns NAME_x, NAME_y, NAME_z of
/// any of palm, thumb, index, middle, ring, little, head, gaze, target, and optionally person, trial,
/// contact (0 or 1).
#[derive(Parser)]
struct Args {
    /// Folder of recordings: every CSV file under it
    #[arg(long)]
    recordings: PathBuf,
    /// Folder for predictions (one row each), scores and figures
    #[arg(long)]
    out: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let candidates = contact_candidates::all();
    let text = contact_report::recordings(&args.recordings, &candidates, args.out.as_deref())?;
    write!(io::stdout(), "{text}").context("standard output")
}
