//! A study of touch: protocol, trials on the arm, answers, report.
//!
//! `cargo run --release --example study -- --simulate 25`

use clap::Parser;
use hwall_lab::touch_study::people;
use hwall_lab::touch_study::settings::ProtocolArgs;
use hwall_lab::touch_study::simulated::{self, Request};
use hwall_stage::exit;
use hwall_stage::numbers::count_within;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs a study of roughness: every subject touches the board in every condition and says how rough it was.
///
/// With --simulate the participants are simulated, too: each has a modulus, noise, lapses and fatigue of its own, and feels
/// what a session on the simulated arm rendered. In the folder of a study are its log, to which every event is appended
/// before the next one, `trials.csv` (what `psychophysics analyse` reads), `attempts.csv` (also practice and spoilt trials),
/// `report.md` and figures.
#[derive(Parser)]
struct Args {
    /// So many simulated participants
    #[arg(
        long,
        value_name = "N",
        value_parser = count_within::<2, 1000>,
        required_unless_present = "run",
        conflicts_with = "run"
    )]
    simulate: Option<usize>,
    /// Run the study of this folder with people, or go on with it
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Subjects of a new study with people
    #[arg(long, default_value_t = 25, requires = "run", value_parser = count_within::<1, 1000>)]
    subjects: usize,
    /// They answer on a page that listens here, and not on the terminal: 127.0.0.1:8081
    #[arg(long, requires = "run")]
    page: Option<SocketAddr>,
    /// Folder of a simulated study [default: nothing is kept]
    #[arg(long, conflicts_with = "run")]
    out: Option<PathBuf>,
    /// Go on with the simulated study of that folder where it stopped
    #[arg(long, requires = "out")]
    resume: bool,
    /// Stop after so many trials, as if killed
    #[arg(long, requires = "out")]
    kill_after: Option<usize>,
    /// Present each condition once, and use that for all its trials: faster
    #[arg(long, conflicts_with = "run")]
    once: bool,
    #[command(flatten)]
    protocol: ProtocolArgs,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let out = &mut std::io::stdout().lock();
    if let Some(folder) = &args.run {
        return people::run(folder, args.subjects, &args.protocol, args.page, out);
    }
    let request = Request {
        subjects: args.simulate.unwrap_or_default(),
        protocol: &args.protocol,
        out: args.out.as_deref(),
        resume: args.resume,
        kill_after: args.kill_after,
        once: args.once,
    };
    simulated::run(&request, out)
}
