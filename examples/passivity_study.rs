//! Does the board give out more energy than a hand has put in? A million contacts.
//!
//! `cargo run --release --example passivity_study`

use clap::Parser;
use hwall_lab::documents::{Destination, bar, show};
use hwall_lab::passivity::document;
use hwall_lab::passivity::study::{self, Request};
use hwall_stage::exit;
use std::process::ExitCode;

/// Simulates contacts at random with and without what keeps the port passive; writes PASSIVITY.md.
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
    let documents = args.destination.open("out/passivity")?;
    let bar = bar(
        "contacts {pos}/{len} {wide_bar} {eta}",
        args.request.contacts,
    );
    let rows = study::run(&args.request, |done| bar.set_position(done))?;
    bar.finish_and_clear();
    let path = document::write(&args.request, &rows, &documents)?;
    let text = document::text(&args.request, &rows);
    show(text, &path)
}
