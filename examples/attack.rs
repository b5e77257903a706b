//! Hostile inputs for everything that reads files, and faults for the control loop.
//!
//! `cargo run --release --example attack -- --inputs 100000 --reader all`

use anyhow::{Context, ensure};
use clap::Parser;
use hwall_lab::attack;
use hwall_lab::documents::Documents;
use hwall_stage::numbers::whole_within;
use hwall_stage::{exit, note, printed};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Attacks readers with inputs made from good ones, and prints what became of them.
///
/// Bits are flipped, ends cut off, pieces of two files joined, numbers made extreme, lines repeated, counts made huge;
/// checksums and digests are made right again. A finding is a panic, or something that was accepted and does not hold
/// what it promises. The control loop is disturbed while it serves touches. Ends with status 2 if there is a finding.
#[derive(Parser)]
struct Args {
    /// Inputs for each reader
    #[arg(long, default_value_t = 100_000, allow_negative_numbers = true, value_parser = whole_within::<1, 1_000_000_000_000>)]
    inputs: u64,
    /// Disturbed runs of the control loop [default: a tenth of the inputs]
    #[arg(long, allow_negative_numbers = true, value_parser = whole_within::<1, 1_000_000_000_000>)]
    runs: Option<u64>,
    /// Only this run of the loop, once more, with the others on its arm
    #[arg(long, conflicts_with_all = ["inputs", "runs", "reader", "docs"])]
    run: Option<u64>,
    /// all, or one of scene, hand, urdf, study, log, calibration, headset, model, regions, map, atlas, stl, exr, session, loop
    #[arg(long, default_value = "all")]
    reader: String,
    /// Seed of the inputs
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write inputs that got through into this folder
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the table over docs/ATTACKS.md
    #[arg(long)]
    docs: bool,
    /// Attack nothing: print what got through once, and the tests that hold it
    #[arg(long, conflicts_with = "docs")]
    findings: bool,
}

fn main() -> ExitCode {
    let args = hwall_stage::arguments::<Args>();
    exit(printed(|out| run(&args, out)))
}

fn run(args: &Args, out: &mut impl Write) -> anyhow::Result<()> {
    if args.findings {
        return Ok(write!(out, "{}", attack::findings::section())?);
    }
    let documents = args.docs.then(Documents::tracked).transpose()?;
    let targets = match args.run {
        Some(_) => attack::targets(attack::LOOP)?,
        None => attack::targets(&args.reader)?,
    };
    // Panics are counted, not shown.
    std::panic::set_hook(Box::new(|_| {}));
    let mut reports = Vec::new();
    for target in &targets {
        let report = match args.run {
            Some(run) => attack::loop_again(run, args.seed)?,
            None => {
                let runs = args.runs.unwrap_or((args.inputs / 10).max(1));
                target.attack(args.inputs, runs, args.seed)?
            }
        };
        for finding in &report.examples {
            note(format_args!(
                "{} input {}: {}",
                report.name, finding.number, finding.what
            ));
            if let Some(folder) = &args.out {
                std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
                let name = format!("{}-{}-{}", report.name, args.seed, finding.number);
                hwall_files::write(folder.join(name), &finding.input)?;
            }
        }
        note(format_args!(
            "{}: slowest was input {}",
            report.name, report.slowest
        ));
        reports.push(report);
    }
    writeln!(out, "{}", attack::table(&reports))?;
    if let Some(documents) = documents {
        let path = attack::write(&reports, args.seed, &documents)?;
        writeln!(out, "wrote {}", path.display())?;
    }
    let findings: u64 = reports.iter().map(|report| report.findings).sum();
    ensure!(findings == 0, "{findings} inputs got through");
    Ok(())
}
