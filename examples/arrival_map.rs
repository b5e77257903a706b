//! How soon the arm can present its board at every place of a scene's walls, and where it should wait.
//!
//! `cargo run --release --example arrival_map`

use clap::Parser;
use hwall_lab::reach::arrival::{self, ArrivalOptions};
use hwall_stage::{exit, printed};
use std::process::ExitCode;

/// Arrival times over the walls of a scene.
///
/// Finds the waiting posture for the places that people touch, chooses a configuration for every place of the walls, and
/// prints how soon these are reached; writes arrival.svg. Base frame of the arm, metres, z up.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    options: ArrivalOptions,
}

fn main() -> ExitCode {
    let options = hwall_stage::arguments::<Args>().options;
    exit(printed(|out| arrival::run(&options, out)))
}
