//! Where to place an arm so that it reaches the walls of a scene.
//!
//! `cargo run --release --example base_placement`

use clap::Parser;
use hwall_lab::reach::placement_job::{self, PlacementOptions};
use hwall_stage::{exit, printed};
use std::process::ExitCode;

/// Scores base positions and headings by how many points of the walls the board reaches, or reaches in time.
///
/// Prints the best placements; writes placement.svg (heat map) and placements.csv, by arrival also
/// placements_by_arrival.csv and arrival.svg. All coordinates are those of the scene, metres, z up.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    options: PlacementOptions,
}

fn main() -> ExitCode {
    let options = hwall_stage::arguments::<Args>().options;
    exit(printed(|out| placement_job::run(&options, out)))
}
