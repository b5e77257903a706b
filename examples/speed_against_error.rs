//! Every algorithm with a speed/accuracy knob: one table and one picture each.
//!
//! `cargo run --release --example speed_against_error`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::speed::control_step;
use hwall_lab::speed::document::{self, Request};
use hwall_stage::{exit, printed};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures speed beside error and writes SPEED-AGAINST-ERROR.md with its figures.
///
/// Times are single calls or batches on one core, errors against exact answers or an oracle;
/// every number in the file comes from this run.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    request: Request,
    /// Measure only this many steps of the control loop in either room, and print their section
    #[arg(long, conflicts_with_all = ["targets", "scene", "readme"], allow_negative_numbers = true)]
    control_steps: Option<u64>,
    /// Also renew the summary between the markers of this file; --docs renews that of docs/CRATES.md
    #[arg(long)]
    readme: Option<PathBuf>,
}

fn main() -> ExitCode {
    let args = hwall_stage::arguments::<Args>();
    exit(printed(|out| run(&args, out)))
}

fn run(args: &Args, out: &mut impl Write) -> anyhow::Result<()> {
    if let Some(steps) = args.control_steps {
        let section = control_step::control_step(args.request.seed, steps as usize)?;
        return writeln!(out, "{}", section.text).context("standard output");
    }
    let documents = args.destination.open("out/speed_against_error")?;
    let path = document::write(&args.request, &documents, args.readme.as_deref(), out)?;
    writeln!(out, "wrote {}, figures beside it", path.display()).context("standard output")
}
