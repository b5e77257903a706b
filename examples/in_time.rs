//! Is the board there before the hand? Every kind of person, over many touches.
//!
//! `cargo run --release --example in_time`

use clap::Parser;
use hwall_contact::LearnedConfig;
use hwall_lab::contact::panels;
use hwall_lab::documents::{Destination, bar, show};
use hwall_lab::in_time::study::{self, Request};
use hwall_lab::in_time::trade_off::{self, Setting};
use hwall_lab::in_time::{document, recorded};
use hwall_stage::exit;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::person::kinds::PersonKind;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Counts how often the board is in place before the hand, and why it is not, for every kind of simulated person; writes
/// IN-TIME.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    request: Request,
    /// The study at each of these losses of a board that is sent for nothing, in missed touches; writes TRADE-OFF.md instead
    #[arg(long, value_name = "TOUCHES", num_args = 1.., conflicts_with = "recordings")]
    false_dispatch: Vec<f64>,
    /// The study at each of these distances within which the board slows down along its face, m; writes FIRST-CONTACTS.md instead
    #[arg(long, value_name = "M", num_args = 1.., conflicts_with_all = ["recordings", "false_dispatch"])]
    along: Vec<f64>,
    /// Recorded people instead, the arm being simulated: a recording of reaches in metres and seconds, as for contact_study; each person is
    /// judged by a predictor that learnt from the others
    #[arg(long, value_name = "FILE", requires = "panels", conflicts_with_all = ["person", "touches", "predictor", "plain"])]
    recordings: Option<PathBuf>,
    /// Trials of the recording: columns person, trial, scene, target, cx, cy, cz, sx, sy, sz, dur, rx, ry, rz, as for contact_study
    #[arg(long, value_name = "FILE", requires = "recordings")]
    panels: Option<PathBuf>,
    /// Only this reach of the recording: prints on standard error why the board is sent or not whenever the choice changes, and writes no document
    #[arg(long, value_name = "PERSON/TRIAL", requires = "recordings", conflicts_with_all = ["docs", "out"])]
    explain: Option<String>,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    if let (Some(stream), Some(trials)) = (&args.recordings, &args.panels) {
        return run_recorded(args, stream, trials);
    }
    let documents = args.destination.open("out/in_time")?;
    let bar = bar("{msg:10} {wide_bar} {percent} %", 1000);
    let progress = |kind: PersonKind, share: f64| {
        bar.set_message(kind.name());
        bar.set_position((1000.0 * share) as u64);
    };
    let varied = [
        (Setting::FalseDispatch, &args.false_dispatch[..]),
        (Setting::Along, &args.along[..]),
    ];
    let asked = varied.into_iter().find(|(_, values)| !values.is_empty());
    if let Some((setting, values)) = asked {
        let points = trade_off::run(&args.request, (setting, values), progress)?;
        bar.finish_and_clear();
        let Request { seed, touches, .. } = args.request;
        let path = trade_off::write(seed, touches, (setting, &points), &documents)?;
        return show(trade_off::table(setting, &points), &path);
    }
    let results = study::run(&args.request, progress)?;
    bar.finish_and_clear();
    let path = document::write(&args.request, &results, &documents)?;
    let text = document::text(&args.request, &results);
    show(text, &path)
}

fn run_recorded(args: &Args, stream: &Path, trials: &Path) -> anyhow::Result<()> {
    FilePlan::default()
        .read("--recordings", Some(stream))
        .read("--panels", Some(trials))
        .check()?;
    let trials = panels::read_files(stream, trials)?;
    let request = recorded::Request {
        trials: &trials,
        learned: LearnedConfig::default(),
        seed: args.request.seed,
        explain: args.explain.as_deref(),
    };
    let documents = match args.explain {
        Some(_) => None,
        None => Some(args.destination.open("out/in_time")?),
    };
    let bar = bar("{msg:10} {wide_bar} {pos} of {len}", trials.len() as u64);
    let results = recorded::run(&request, |person| {
        bar.set_message(person.to_owned());
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let text = document::recorded_text(args.request.seed, &results)?;
    let mut out = io::stdout();
    writeln!(out, "{text}")?;
    for (reach, why) in &results.missed {
        writeln!(out, "{}: {reach}", why.name())?;
    }
    if let Some(documents) = documents {
        let path = document::write_recorded(&text, &documents)?;
        writeln!(out, "wrote {}", path.display())?;
    }
    Ok(())
}
