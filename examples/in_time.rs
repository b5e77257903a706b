//! Is the board there before the hand? Every kind of person, over many touches.
//!
//! `cargo run --release --example in_time`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::in_time::document;
use hwall_lab::in_time::study::{self, Request};
use hwall_stage::exit;
use hwall_stage::numbers::whole_within;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::PredictorKind;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::process::ExitCode;

/// Counts how often the board is in place before the hand, and why it is not, for every kind of simulated person; writes
/// IN-TIME.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Kinds of people [default: all]
    #[arg(long, value_enum, num_args = 1..)]
    person: Vec<PersonKind>,
    /// Touches of each kind, a dozen for each person
    #[arg(long, default_value_t = 1200, value_parser = whole_within::<1, 100_000>, allow_negative_numbers = true)]
    touches: u64,
    /// Seed of the people and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Who leads the board [default: fused]
    #[arg(long, value_enum)]
    predictor: Option<PredictorKind>,
    /// The board presents no roughness
    #[arg(long)]
    plain: bool,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/in_time")?;
    let kinds = match &args.person[..] {
        [] => PersonKind::ALL.to_vec(),
        chosen => chosen.to_vec(),
    };
    let request = Request {
        kinds,
        touches: args.touches as usize,
        seed: args.seed,
        leader: args.predictor,
        textured: !args.plain,
    };
    let style = ProgressStyle::with_template("{msg:10} {wide_bar} {percent} %")?;
    let bar = ProgressBar::new(1000).with_style(style);
    let results = study::run(&request, |kind, share| {
        bar.set_message(kind.name());
        bar.set_position((1000.0 * share) as u64);
    })?;
    bar.finish_and_clear();
    let path = document::write(&request, &results, &documents)?;
    let text = document::text(&request, &results);
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")
}
