//! Where will a hand touch, estimated while it is on its way? Every estimator on held-out reaches.
//!
//! `cargo run --release --example contact_study`

use anyhow::Context;
use clap::Parser;
use hwall_lab::study::arguments::Arguments;
use hwall_stage::exit;
use std::io::{self, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    exit(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let text = arguments.run()?;
    write!(io::stdout(), "{text}").context("standard output")
}
