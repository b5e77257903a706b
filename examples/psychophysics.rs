//! Plans, analyses and sizes studies of perception.
//!
//! `cargo run --release --example psychophysics -- analyse study.csv --subject person --factors a,b --value y`

use clap::{Parser, Subcommand};
use hwall_lab::psychophysics::{analyse, design, power};
use hwall_stage::exit;
use std::process::ExitCode;

/// Statistics of studies with repeated measures.
///
/// Tables are CSV with a header line, one row a trial. Every number of an analysis is in its JSON.
#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Analysis of variance, aligned ranks and comparisons of pairs of a study's table
    Analyse(analyse::Args),
    /// The order of every subject's trials, as CSV
    Design(design::Args),
    /// How often a study of a given size finds an effect of a given size
    Power(power::Args),
}

fn main() -> ExitCode {
    exit(match hwall_stage::arguments::<Args>().command {
        Command::Analyse(args) => analyse::run(&args),
        Command::Design(args) => design::run(&args),
        Command::Power(args) => power::run(&args),
    })
}
