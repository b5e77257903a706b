//! What does it cost to lead the arm by joints instead of places? The dissertation's end-to-end response, measured.
//!
//! `cargo run --release --example end_to_end`

use clap::Parser;
use hwall_lab::documents::{Destination, bar, show};
use hwall_lab::end_to_end::document;
use hwall_lab::end_to_end::study::{self, Request};
use hwall_stage::{exit, note};
use std::io::{self, IsTerminal};
use std::process::ExitCode;

/// Judges joints that are inferred from the hand by centimetres, by tasks told apart and by touches in time; writes END-TO-END.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    request: Request,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/end_to_end")?;
    let bar = bar("{msg:15} {wide_bar} {percent} %", 1000);
    // Where no bar can be drawn, a line for every tenth of a chapter says that something is done.
    let is_drawn = io::stderr().is_terminal();
    let mut noted = (String::new(), 0);
    let results = study::run(&args.request, |chapter, share| {
        bar.set_message(chapter.to_owned());
        bar.set_position((1000.0 * share) as u64);
        let tenth = (10.0 * share) as u32;
        if !is_drawn && (noted.0 != chapter || noted.1 != tenth) {
            note(format!("{chapter}: {} %", 10 * tenth));
            noted = (chapter.to_owned(), tenth);
        }
    })?;
    bar.finish_and_clear();
    let path = document::write(&args.request, &results, &documents)?;
    let text = document::text(&args.request, &results)?;
    show(text, &path)
}
