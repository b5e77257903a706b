//! Walks through the corridor of rooms with a base that drives: the tables of docs/ENVIRONMENTS.md.
//!
//! `cargo run --release -p hwall-lab --example corridor_study`

use clap::Parser;
use hwall_lab::documents::{Destination, renew_block};
use hwall_stage::corridor::study;
use hwall_stage::exit;
use hwall_stage::input::arms::NamedArm;
use std::process::ExitCode;

/// A base that drives in a corridor of rooms, with several seeds: shares in place, their price in speed beside a hand, and what became of the touches.
/// Prints the tables and writes them to the output folder, or with --docs into docs/ENVIRONMENTS.md. Takes minutes.
#[derive(Parser)]
struct Args {
    /// Seeds of rooms and walkers
    #[arg(long, value_delimiter = ',', default_values_t = [1, 11, 21, 22, 23, 24, 25])]
    seeds: Vec<u64>,
    /// Speeds at which a hand may meet the base, m/s, compared with the first three seeds
    #[arg(long, value_delimiter = ',', default_values_t = [0.0, 0.1, 0.15, 0.2, 0.3])]
    hand_meets: Vec<f64>,
    #[command(flatten)]
    arm: NamedArm,
    #[command(flatten)]
    destination: Destination,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/corridor_study")?;
    anyhow::ensure!(!args.seeds.is_empty(), "--seeds: at least one");
    let fits = |speed: &f64| (0.0..=0.3).contains(speed);
    anyhow::ensure!(
        args.hand_meets.iter().all(fits),
        "--hand-meets must lie in 0..=0.3 m/s"
    );
    let text = study(&args.arm, &args.seeds, &args.hand_meets)?;
    print!("{text}");
    match documents.readme() {
        Some(_) => renew_block(&documents.folder().join("ENVIRONMENTS.md"), "base", &text),
        None => documents.write("base.md", &text).map(drop),
    }
}
