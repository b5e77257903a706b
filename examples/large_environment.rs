//! Which touches of an environment far larger than the room can one fixed arm present?
//!
//! `cargo run --release --example large_environment -- --touches 200 --seed 1`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::environment::document;
use hwall_lab::environment::study::{self, Request};
use hwall_redirection::SampledOrientations;
use hwall_stage::numbers::whole_within;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::{exit, note};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// A person steers an avatar through a gym of walls, mirrors and doors and touches them; counts what the arm presents in time,
/// with snapped orientations, turned avatars, exact orientations and shifted hands; writes ENVIRONMENTS.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Touches, the same for every kind of redirection
    #[arg(long, default_value_t = 200, value_parser = whole_within::<1, 100_000>, allow_negative_numbers = true)]
    touches: u64,
    /// Seed of the gym and of the person
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// OBJ scene, z up, its lowest point on the floor [default: a gym of the seed]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Kinds of people, by their pace
    #[arg(long, value_enum, num_args = 1.., default_values = ["plain", "fast"])]
    person: Vec<PersonKind>,
    /// iiwa7 or iiwa14
    #[arg(long, default_value = "iiwa7", value_parser = ["iiwa7", "iiwa14"])]
    arm: String,
    /// Distance between the orientations for which there are maps, degrees; 15 are those of the published maps
    #[arg(long, default_value_t = 22.5, allow_negative_numbers = true)]
    step_deg: f64,
    /// The last of them on each side, degrees
    #[arg(long, default_value_t = 45.0, allow_negative_numbers = true)]
    end_deg: f64,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let orientations =
        SampledOrientations::new(args.step_deg.to_radians(), args.end_deg.to_radians())
            .context("--step-deg, --end-deg")?;
    let documents = args.destination.open("out/large_environment")?;
    let request = Request {
        touches: args.touches as usize,
        seed: args.seed,
        scene: args.scene.clone(),
        people: args.person.clone(),
        arm: args.arm.clone(),
        orientations,
    };
    let results = study::run(&request)?;
    for remark in &results.remarks {
        note(remark);
    }
    let path = document::write(&request, &results, &documents)?;
    let text = document::text(&results);
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")
}
