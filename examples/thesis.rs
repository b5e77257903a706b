//! The dissertation, redone: each of its figures and tables beside the published numbers, as a page and as Markdown.
//!
//! `cargo run --release --example thesis -- --chapter 4`

use anyhow::Context;
use clap::Parser;
use hwall_lab::documents::Destination;
use hwall_lab::reach::published;
use hwall_lab::thesis::Chapter;
use hwall_lab::thesis::document::{self, Request};
use hwall_stage::{exit, note, printed};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Redoes figures, tables and experiments of the dissertation, chapter by chapter, in two minutes, with simulated people.
///
/// Writes thesis.html, which needs no other file and no network, THESIS.md with its figures beside it; with --docs only the latter two. Every
/// number on our side comes from this run. Parts that need data which are not part of the project say that they were skipped.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// Only this chapter: III, IV, V, VI or VII, or 3 to 7
    #[arg(long, value_name = "N", value_parser = Chapter::numbered, allow_negative_numbers = true)]
    chapter: Option<Chapter>,
    /// Seed of simulated people and sensors
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    #[arg(long, value_name = "DIR", help = format!("Folder with ori_1.txt .. ori_7.txt, the maps published with the 2018 paper [default: {}, if it is there]", published::FOLDER))]
    published: Option<PathBuf>,
}

fn main() -> ExitCode {
    let args = hwall_stage::arguments::<Args>();
    exit(printed(|out| run(&args, out)))
}

fn run(args: &Args, out: &mut impl Write) -> anyhow::Result<()> {
    let documents = args.destination.open("out/thesis")?;
    let request = Request {
        chapter: args.chapter,
        seed: args.seed,
        published: args.published.as_deref(),
    };
    let path = document::write(&request, &documents, |chapter| {
        note(format_args!("chapter {}", chapter.name()));
    })?;
    writeln!(out, "wrote {}", path.display()).context("standard output")
}
