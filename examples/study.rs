//! A study of touch: protocol, trials on the arm, answers, report.
//!
//! `cargo run --release --example study -- --simulate 25`

use anyhow::{Context, ensure};
use clap::{ArgGroup, Parser};
use hwall_lab::touch_study::arm::ArmArgs;
use hwall_lab::touch_study::people::{self, Setup};
use hwall_lab::touch_study::settings::ProtocolArgs;
use hwall_lab::touch_study::simulated::{self, Request};
use hwall_stage::console::Printout;
use hwall_stage::exit;
use hwall_stage::input::address::socket_address;
use hwall_stage::numbers::count_within;
use hwall_study::{ArmStop, Study};
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Runs a study of roughness: every subject touches the board in every condition and says how rough it was.
///
/// With --simulate the participants are simulated, too: each has a modulus, noise, lapses and fatigue of its own, and feels
/// what a session on the simulated arm rendered. In the folder of a study are its log, to which every event is appended
/// before the next one, `trials.csv` (what `psychophysics analyse` reads), `attempts.csv` (also practice and spoilt trials),
/// `report.md` and figures. Exit status: 0 when the study is done, 1 when it ended before, 130 after Ctrl-C, 2 for what cannot be
/// done.
#[derive(Parser)]
#[command(group(ArgGroup::new("participants").required(true).args(["simulate", "run"])))]
struct Args {
    /// So many simulated participants
    #[arg(
        long,
        value_name = "N",
        conflicts_with_all = ["fri", "led"],
        value_parser = count_within::<2, 1000>, allow_negative_numbers = true
    )]
    simulate: Option<usize>,
    /// Run the study of this folder with people, or go on with it
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Subjects of a new study with people [default: 25]
    #[arg(long, conflicts_with = "simulate", value_parser = count_within::<1, 1000>, allow_negative_numbers = true)]
    subjects: Option<usize>,
    /// They answer on a page that listens here, and not on the terminal: localhost:8081
    #[arg(long, conflicts_with = "simulate", value_name = "HOST:PORT", value_parser = socket_address)]
    page: Option<SocketAddr>,
    /// Folder of a simulated study [default: nothing is kept]
    #[arg(long, conflicts_with = "run")]
    out: Option<PathBuf>,
    /// Go on with the study of that folder where it stopped; --run does so anyway, and with this begins no new one
    #[arg(long)]
    resume: bool,
    /// Stop after so many trials, as if killed
    #[arg(
        long,
        requires = "out",
        conflicts_with = "run",
        allow_negative_numbers = true
    )]
    kill_after: Option<usize>,
    /// Present each condition once, and use that for all its trials: faster
    #[arg(long, conflicts_with = "run")]
    once: bool,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    protocol: ProtocolArgs,
}

/// Ctrl-C was pressed.
static STOP: AtomicBool = AtomicBool::new(false);

/// Stops an arm that moves.
static ARM: OnceLock<ArmStop> = OnceLock::new();

/// The status of a program that ended by Ctrl-C.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    match run(&hwall_stage::arguments::<Args>()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) if STOP.load(Ordering::Relaxed) => ExitCode::from(INTERRUPTED),
        Ok(false) => ExitCode::FAILURE,
        Err(_) if STOP.load(Ordering::Relaxed) => ExitCode::from(INTERRUPTED),
        Err(error) => exit(Err(error)),
    }
}

/// Is the study done, or stopped as was asked for?
fn run(args: &Args) -> anyhow::Result<bool> {
    let with_people = args.run.is_some();
    ctrlc::set_handler(move || {
        // A second one ends it at once, as the first does where a person is asked: tables and log are written by then, an arm is at rest.
        if STOP.swap(true, Ordering::Relaxed) || with_people {
            if let Some(arm) = ARM.get() {
                arm.stop_within(Duration::from_secs(3));
            }
            std::process::exit(INTERRUPTED.into());
        }
    })?;
    if let Some(folder) = &args.run {
        let there = Study::log_path(folder).exists();
        ensure!(there || !args.resume, "{}: no study", folder.display());
        let setup = Setup {
            page: args.page,
            arm: &args.arm,
            stop: &ARM,
        };
        let out = &mut io::stdout().lock();
        return people::run(folder, args.subjects, &args.protocol, setup, out);
    }
    let request = Request {
        subjects: args.simulate.unwrap_or_default(),
        protocol: &args.protocol,
        out: args.out.as_deref(),
        resume: args.resume,
        kill_after: args.kill_after,
        once: args.once,
        stop: &STOP,
    };
    let mut out = Printout::new(io::stdout());
    let done = simulated::run(&request, &mut out)?;
    out.finish().context("standard output")?;
    Ok(done)
}
