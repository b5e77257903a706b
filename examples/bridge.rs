//! Hands from a headset's browser or a mouse, a live view of the simulated iiwa in any browser.
//!
//! `cargo run --release --example bridge`

use anyhow::Context;
use clap::Parser;
use hwall_bridge::BridgeServer;
use hwall_stage::live::{self, LiveFlags};
use hwall_stage::{exit, note};
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Serves a page on which a mouse, a finger or the hands in a headset touch the walls of a room, and a simulated arm
/// brings its board there.
///
/// Prints the address; ends on Ctrl-C.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    flags: LiveFlags,
}

/// The status of a program that Ctrl-C ended before it had anything to write.
const INTERRUPTED: i32 = 130;

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>().flags))
}

fn run(flags: &LiveFlags) -> anyhow::Result<()> {
    flags.check()?;
    let server = BridgeServer::start(flags.server()?)?;
    let stop = server.stop_handle();
    static PREPARED: AtomicBool = AtomicBool::new(false);
    let unrecorded = flags.record.clone();
    let stops = move || {
        stop.stop();
        // Nothing is under way yet that would have to be ended.
        if !PREPARED.load(Ordering::Relaxed) {
            if let Some(path) = &unrecorded {
                note(format_args!(
                    "stopped while preparing: nothing was recorded, there is no {}",
                    path.display()
                ));
                std::process::exit(INTERRUPTED);
            }
            std::process::exit(0);
        }
    };
    ctrlc::set_handler(stops).context("Ctrl-C")?;
    say(&server.invitation())?;
    note("preparing");
    let prepared = live::prepare(&server, flags)?;
    PREPARED.store(true, Ordering::Relaxed);
    for remark in &prepared.remarks {
        note(remark);
    }
    live::run(&server, prepared, flags)?;
    say(&server.counts().to_string())
}

fn say(line: &str) -> anyhow::Result<()> {
    Ok(writeln!(io::stdout(), "{line}")?)
}
