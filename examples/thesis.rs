//! The dissertation, redone: each of its figures and tables beside the published numbers, as a page and as Markdown.
//!
//! `cargo run --release --example thesis -- --chapter 4`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::thesis::document::{self, Request};
use hwall_stage::{exit, note, printed};
use std::io::Write;
use std::process::ExitCode;

/// Redoes figures, tables and experiments of the dissertation, chapter by chapter, in two minutes, with simulated people.
///
/// Writes thesis.html, which needs no other file and no network, THESIS.md with its figures beside it; with --docs only the latter two. Every
/// number on our side comes from this run. Parts that need data which are not part of the project say that they were skipped.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    request: Request,
}

fn main() -> ExitCode {
    let args = hwall_stage::arguments::<Args>();
    exit(printed(|out| run(&args, out)))
}

fn run(args: &Args, out: &mut impl Write) -> anyhow::Result<()> {
    let documents = args.destination.open("out/thesis")?;
    let path = document::write(&args.request, &documents, |chapter| {
        note(format_args!("chapter {}", chapter.name()));
    })?;
    writeln!(out, "wrote {}", path.display()).context("standard output")
}
