//! Does the board give out more energy than a hand has put in? A million contacts.
//!
//! `cargo run --release --example passivity_study`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::passivity::document;
use hwall_lab::passivity::study::{self, Request};
use hwall_stage::exit;
use hwall_stage::numbers::whole_within;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::process::ExitCode;

/// Simulates contacts at random with and without what keeps the port passive; writes PASSIVITY.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Number of contacts
    #[arg(long, default_value_t = 1_000_000, value_parser = whole_within::<1, 100_000_000>, allow_negative_numbers = true)]
    contacts: u64,
    /// Seed of the contacts and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/passivity")?;
    let request = Request {
        contacts: args.contacts,
        seed: args.seed,
    };
    let style = ProgressStyle::with_template("contacts {pos}/{len} {wide_bar} {eta}")?;
    let bar = ProgressBar::new(args.contacts).with_style(style);
    let rows = study::run(&request, |done| bar.set_position(done))?;
    bar.finish_and_clear();
    let path = document::write(&request, &rows, &documents)?;
    let text = document::text(&request, &rows);
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")
}
