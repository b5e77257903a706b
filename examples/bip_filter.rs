//! Learns from a folder of motions, filters another one, and reports how well their ends were predicted.
//!
//! `cargo run --release --example bip_filter`

use anyhow::Context;
use clap::Parser;
use hwall_lab::bip::setup::{BasisChoice, Indices, Mode, Noise, Setup};
use hwall_lab::bip::trajectories::TrainTest;
use hwall_lab::bip::{figures, reaches, report, run, scores, trajectories};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::{exit, note};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Where will a motion end, seen from its beginning? Trains on CSV files, runs a filter over others.
///
/// One file a motion, one row a sample, a header, one column a degree of freedom in any unit. A
/// first column `t` holds time, s; without it time counts samples. An empty cell of a test file
/// was not observed. A folder that is given twice is split by names that start with train and
/// test. Without folders: synthetic reaches. Prints errors, coverage and times.
#[derive(Parser)]
struct Args {
    /// Folder of training motions
    #[arg(long, requires_all = ["test", "observed"])]
    train: Option<PathBuf>,
    /// Folder of test motions
    #[arg(long, requires = "train")]
    test: Option<PathBuf>,
    /// Columns that the filter sees, from 0, not counting `t`: a-b,c,... [default of the synthetic ones: 0-17]
    #[arg(long, requires = "train")]
    observed: Option<Indices>,
    /// poly:N, legendre:N, chebyshev:N, gauss:N[:VARIANCE], ngauss:N[:VARIANCE], sigmoid:N:WIDTH, auto (by leave-one-out), auto:aic, auto:bic
    #[arg(long, default_value = "ngauss:9")]
    basis: BasisChoice,
    /// exact, compat (the published one; implies --published), bank, ensemble:N
    #[arg(long, default_value = "exact")]
    mode: Mode,
    /// Variance of the phase at the start
    #[arg(long, default_value_t = 1e-4, allow_negative_numbers = true)]
    phase_var: f64,
    /// Variance of the acceleration of the phase, 1/time^4 [default: tuned by loo, else the library's]
    #[arg(long, allow_negative_numbers = true)]
    process_var: Option<f64>,
    /// Measurement noise: fit, loo (chosen on training motions left out one at a time), or a factor
    /// on the variance of the fit [default: fit for compat, else loo]
    #[arg(long)]
    noise: Option<Noise>,
    /// Train by the published conventions: no centring, phase velocity 1 / samples
    #[arg(long)]
    published: bool,
    /// Seed of the synthetic reaches
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the filter's estimates after every sample, JSON
    #[arg(long)]
    out: Option<PathBuf>,
    /// Folder for the figures: error and coverage against the share seen
    #[arg(long)]
    svg: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(filter(&hwall_stage::arguments::<Args>()))
}

fn filter(args: &Args) -> anyhow::Result<()> {
    FilePlan::default()
        .read("--train", args.train.as_deref())
        .read("--test", args.test.as_deref())
        .write("--out", args.out.as_deref())
        .write_into("--svg", args.svg.as_deref(), &["error.svg", "coverage.svg"])
        .check()?;
    if let Some(folder) = &args.svg {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let TrainTest { train, test } = match (&args.train, &args.test) {
        (Some(train), Some(test)) => trajectories::read_both(train, test)?,
        _ => reaches::sets(args.seed, 40, 30),
    };
    if train == test {
        note("note: the test motions are the training motions");
    }
    let setup = Setup {
        basis: args.basis,
        observed: match &args.observed {
            Some(observed) => observed.clone(),
            None => reaches::OBSERVED.parse()?,
        },
        mode: args.mode,
        noise: args.noise.unwrap_or(match args.mode {
            Mode::Compat => Noise::Fit,
            _ => Noise::HeldOut,
        }),
        phase_variance: args.phase_var,
        process_variance: args.process_var,
        published: args.published,
    };
    let trained = setup.train(&train)?;
    let runs = run::run(&setup, &trained, &test)?;
    if let Some(path) = &args.out {
        report::write_json(path, &setup, &trained, &test.columns, &runs)?;
    }
    if let Some(folder) = &args.svg {
        let sets = scores::dof_sets(&setup, &trained);
        figures::errors(&folder.join("error.svg"), &sets, &runs.tests)?;
        figures::coverage(&folder.join("coverage.svg"), &sets, &runs.tests)?;
    }
    let text = report::tables(&setup, &trained, &runs);
    write!(io::stdout(), "{text}").context("standard output")
}
