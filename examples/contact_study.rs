//! Where will a hand touch, seen from the beginning of its reach? Every estimator on held-out reaches.
//!
//! `cargo run --release --example contact_study`

use anyhow::{Context, ensure};
use clap::{Parser, ValueEnum};
use hwall_examples::contact_dissertation::{self, Choice};
use hwall_examples::demonstration_files::{Robot, generate_into};
use hwall_examples::demonstrations::DemonstrationConfig;
use hwall_examples::{
    contact_candidates, contact_document, contact_report, contact_rooms_study, exit,
};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares estimators of where and when a hand touches, on reaches that they were not trained with.
///
/// Recordings are CSV files, one row a sample, metres and seconds: t, columns NAME_x, NAME_y, NAME_z of
/// any of palm, thumb, index, middle, ring, little, head, gaze, target, and optionally person, trial,
/// contact (0 or 1). With a person column one person at a time is held out.
#[derive(Parser)]
struct Args {
    /// Folder of recordings: every CSV file under it
    #[arg(long, conflicts_with_all = ["protocol", "generate"])]
    recordings: Option<PathBuf>,
    /// Simulated people instead of recordings
    #[arg(long, value_enum, default_value_t = Protocol::Dissertation)]
    protocol: Protocol,
    /// Only write the demonstrations of the protocol into this folder
    #[arg(long)]
    generate: Option<PathBuf>,
    /// Folder for predictions (one row each), scores and figures
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write all protocols into this document instead, with the recordings if they are named
    #[arg(long)]
    report: Option<PathBuf>,
    /// Seed of the simulated people
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulated people to learn from [default: that of the protocol]
    #[arg(long)]
    people: Option<usize>,
    /// Reaches of all of them together [default: that of the protocol]
    #[arg(long)]
    reaches: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Protocol {
    /// 47 reaches to learn from, 30 of other people to be judged by, one static panel
    Dissertation,
    /// Pointing in the air, 1,625 reaches of 13 people, each person held out
    Pointing,
    /// Rooms of 1, 3, 6 and 12 surfaces, and one of them under worse and worse conditions
    Rooms,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let choice = Choice {
        seed: args.seed,
        people: args.people,
        reaches: args.reaches,
    };
    if matches!(args.protocol, Protocol::Rooms) {
        let same = args.people.is_none() && args.reaches.is_none() && args.generate.is_none();
        ensure!(same, "--protocol rooms takes --seed and --out alone");
    }
    if let Some(folder) = &args.generate {
        let config = choice.of(match args.protocol {
            Protocol::Pointing => DemonstrationConfig::pointing(),
            _ => DemonstrationConfig::dissertation(),
        });
        let made = generate_into(folder, &config, Robot::default())?;
        return writeln!(io::stdout(), "{made}").context("standard output");
    }
    let out = args.out.as_deref();
    if let Some(folder) = out {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let candidates = contact_candidates::all();
    if let Some(file) = &args.report {
        let recordings = args.recordings.as_deref();
        return contact_document::write(file, choice, &candidates, recordings, out);
    }
    let text = match (&args.recordings, args.protocol) {
        (Some(dir), _) => contact_report::recordings(dir, &candidates, out)?,
        (None, Protocol::Dissertation) => contact_dissertation::report(choice, &candidates, out)?,
        (None, Protocol::Rooms) => contact_rooms_study::report(args.seed, out)?,
        (None, Protocol::Pointing) => contact_dissertation::pointing(choice, &candidates, out)?,
    };
    write!(io::stdout(), "{text}").context("standard output")
}
