//! Every fault in every phase of a touch: which safe state, how soon, and what a hand meets.
//!
//! `cargo run --release --example fault_matrix`

use anyhow::{Context, ensure};
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::faults::document;
use hwall_lab::faults::study::{self, Request};
use hwall_stage::exit;
use hwall_stage::run::simulated_arm::ArmLevel;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::process::ExitCode;

/// Injects every fault in every phase of a touch at both arm levels, and lets hands hit the board; writes FAULTS.md.
///
/// Fails if a fault does not end in a named safe state in time; the other verdicts only report.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Seeds of the sensors' noise; the worst of all runs counts
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        allow_negative_numbers = true
    )]
    seeds: Vec<u64>,
    /// How much of the arm is simulated; default both
    #[arg(long)]
    arm_level: Option<ArmLevel>,
    /// Only faults whose names contain this
    #[arg(long)]
    only: Option<String>,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/faults")?;
    let request = Request {
        seeds: args.seeds.clone(),
        levels: match args.arm_level {
            Some(level) => vec![level],
            None => vec![ArmLevel::Servo, ArmLevel::Torque],
        },
        only: args.only.clone(),
    };
    let style = ProgressStyle::with_template("combinations {pos}/{len} {wide_bar} {eta}")?;
    let bar = ProgressBar::new(0).with_style(style);
    let results = study::run(&request, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let path = document::write(&request, &results, &documents)?;
    let text = document::text(&request, &results);
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")?;
    let bad = results.unsafe_ones().count();
    ensure!(
        bad == 0,
        "{bad} combinations reach no safe state in time; see {}",
        path.display()
    );
    Ok(())
}
