//! A roughness for the surfaces of a scene, proposed from pictures of their materials, with what a picture cannot tell.
//!
//! `cargo run --release --example texture_assign -- table=oak.png@0.3 wall=plaster.png@0.5 --sidecar room.toml`

use clap::Parser;
use hwall_lab::texture::assign::{self, AssignArgs};
use hwall_stage::{exit, printed};
use std::process::ExitCode;

/// Proposes a roughness for each picture, on a ratio scale on which sandpaper P80 is 1, and the levels of the bumpy board that stand for them.
///
/// The proposal is rough: a height map gives relief and slope, a colour picture only shading that may be a print. The 90 % intervals, and
/// what is not told by a picture, are printed. A picture without information (uniform, too small, without a width, or too coarse for a
/// finger) is refused.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    assign: AssignArgs,
}

fn main() -> ExitCode {
    let args = hwall_stage::arguments::<Args>();
    exit(printed(|out| assign::run(&args.assign, out)))
}
