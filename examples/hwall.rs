//! The main job: a simulated iiwa 7 carries a board to the wall that a hand is about to touch.
//!
//! `cargo run --release --example hwall`

use clap::Parser;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::job::{self, JobOptions};
use hwall_stage::{exit, printed, recording};
use indicatif::{ProgressBar, ProgressStyle};
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

/// A simulated arm presents a board where a hand is about to touch a virtual wall.
///
/// Without options: a room made for this, a simulated person and twelve touches, foreseen by what
/// other simulated people taught. Prints four tables; writes plan.svg, time.svg, replay.html (open it in a browser), touch.svg, table.md and touches.csv to the output folder.
/// More than twelve touches are made by several people, each in a run of their own; figures and lists are then of the first.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    job: JobOptions,
    /// Runs the sessions of such a file again instead, and compares every command bit by bit
    #[arg(long, exclusive = true)]
    replay: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(path) = &args.replay {
        FilePlan::default().read("--replay", Some(path)).check()?;
        return recording::replay(path, &mut io::stdout());
    }
    let bar =
        ProgressBar::new(1000).with_style(ProgressStyle::with_template("{wide_bar} {percent} %")?);
    let progress = |share: f64| {
        bar.set_position((1000.0 * share) as u64);
        if share >= 1.0 {
            bar.finish_and_clear();
        }
    };
    let done = printed(|out| job::run(&args.job, out, progress));
    bar.finish_and_clear();
    done
}
