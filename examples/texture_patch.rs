//! A textured board to print: watertight mesh, height field, and what a finger meets on it.
//!
//! `cargo run --release --example texture_patch -- --stl patch.stl --out figures`

use clap::Parser;
use hwall_lab::texture::patch::{self, Request};
use hwall_stage::{exit, printed};
use std::process::ExitCode;

/// Designs a patch of bumps and writes it as a closed solid.
///
/// Prints what the mesh is (triangles, watertight or not, chord error measured on it, volume against the
/// exact one), what a printer cannot make of it, and for each orientation of the scan the width w, the
/// spacing d, the mean distance of encounters and their frequency over speed. Angles are from the long axis
/// of the bumps.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    request: Request,
}

fn main() -> ExitCode {
    let request = hwall_stage::arguments::<Args>().request;
    exit(printed(|out| patch::run(&request, out)))
}
