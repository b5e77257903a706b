//! Compares with what others have published, and writes docs/VALIDATION.md.
//!
//! `cargo run --release --example validation -- --published DIR`

use anyhow::Context;
use clap::Parser;
use hwall_lab::reach::figures as reach_figures;
use hwall_lab::reach::published;
use hwall_lab::validation::bip as bip_validation;
use hwall_lab::validation::perception as perception_validation;
use hwall_lab::validation::tables as validation;
use hwall_lab::validation::texture as texture_validation;
use hwall_stage::exit;
use hwall_testkit::Machine;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Writes VALIDATION.md with its figures; every number in it comes from this run.
#[derive(Parser)]
struct Args {
    /// Folder with ori_1.txt .. ori_7.txt, the maps published with the 2018 paper
    #[arg(long, default_value = "../shared/data/hwall_maps_2018")]
    published: PathBuf,
    /// Folder with the reference runs of Bayesian Interaction Primitives and their workload
    #[arg(long, default_value = "../shared/reference/bip")]
    bip: PathBuf,
    /// Folder with reference numbers of textures
    #[arg(long, default_value = "../shared/reference/texton")]
    texton: PathBuf,
    /// Folder with reference studies and their analyses
    #[arg(long, default_value = "../shared/reference/psychophysics")]
    psychophysics: PathBuf,
    /// Folder for VALIDATION.md and figures/
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Seed of the random poses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Random poses
    #[arg(long, default_value_t = 10_000_000)]
    poses: usize,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let published = published::read(&args.published)?;
    let machine = Machine::detect(args.seed);
    let found = validation::reachability(&published, args.seed, args.poses)?;
    let bip = bip_validation::section(&args.bip)?;
    let textures = texture_validation::section(&args.texton, args.seed)?;
    let perception = perception_validation::section(&args.psychophysics)?;
    let text = format!(
        "# Validation\n\nWritten by `cargo run --release --example validation`; not edited by hand. \
         Poses, Jacobians and dynamics are compared with Pinocchio in the tests of hwall-kinematics, \
         which keep the data they need.\n\n{machine}\n\n{}\n{bip}\n{textures}\n{perception}",
        found.text,
    );
    let figures = args.out.join("figures/reachability");
    std::fs::create_dir_all(&figures).with_context(|| figures.display().to_string())?;
    reach_figures::comparison(&figures.join("comparison.svg"), &found.comparisons)?;
    let worst = figures.join("worst_plane.svg");
    reach_figures::worst_plane(&worst, &published::grids()?, &found.rows, &published)?;
    let path = args.out.join("VALIDATION.md");
    std::fs::write(&path, &text).with_context(|| path.display().to_string())?;
    writeln!(io::stdout(), "{text}\nwrote {}", path.display())?;
    Ok(())
}
