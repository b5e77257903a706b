//! Every fault in every phase of a touch: which safe state, how soon, and what a hand meets.
//!
//! `cargo run --release --example fault_matrix`

use anyhow::ensure;
use clap::Parser;
use hwall_lab::documents::{Destination, bar, show};
use hwall_lab::faults::document;
use hwall_lab::faults::study::{self, Request};
use hwall_stage::exit;
use std::process::ExitCode;

/// Injects every fault in every phase of a touch at both arm levels, and lets hands hit the board; writes FAULTS.md.
///
/// Fails if a fault does not end in a named safe state in time; the other verdicts only report.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    request: Request,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/faults")?;
    let bar = bar("combinations {pos}/{len} {wide_bar} {eta}", 0);
    let results = study::run(&args.request, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let path = document::write(&args.request, &results, &documents)?;
    let text = document::text(&args.request, &results);
    show(text, &path)?;
    let bad = results.unsafe_ones().count();
    ensure!(
        bad == 0,
        "{bad} combinations reach no safe state in time; see {}",
        path.display()
    );
    Ok(())
}
