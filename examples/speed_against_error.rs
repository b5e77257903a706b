//! Every algorithm with a speed/accuracy knob: one table and one picture each.
//!
//! `cargo run --release --example speed_against_error` writes docs/SPEED-AGAINST-ERROR.md.

use clap::Parser;
use hwall_lab::speed::bip as speed_bip;
use hwall_lab::speed::contact as speed_contact;
use hwall_lab::speed::fusion as speed_contact_fusion;
use hwall_lab::speed::knobs as speed_contact_knobs;
use hwall_lab::speed::reach as speed_reach;
use hwall_lab::speed::roughness as speed_roughness;
use hwall_lab::speed::scene as speed_scene;
use hwall_lab::speed::tables as speed;
use hwall_lab::speed::texture as speed_texture;
use hwall_stage::exit;
use hwall_testkit::Machine;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures speed beside error and writes SPEED-AGAINST-ERROR.md with its figures.
///
/// Times are single calls or batches on one core, errors against exact answers or an oracle;
/// every number in the file comes from this run.
#[derive(Parser)]
struct Args {
    /// Folder for SPEED-AGAINST-ERROR.md and figures/
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Seed of every target
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Targets per row
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(100..=1_000_000))]
    targets: u64,
    /// OBJ file for the ray casts and closest points; default: the built-in room full of bumpy balls
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Also renew the summary between the markers of this README
    #[arg(long)]
    readme: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let figures = args.out.join("figures");
    std::fs::create_dir_all(&figures)?;
    let machine = Machine::detect(args.seed);
    let mut text = format!(
        "# Speed against error\n\nWritten by `cargo run --release --example speed_against_error`; not edited \
         by hand.\n\n{machine}\n\nMedian and p99 are per call; calls below a microsecond are timed in batches, \
         so their p99 is over batches. Errors are against the exact answer named with each table.\n"
    );
    let n = args.targets as usize;
    let sections = [
        speed::forward(args.seed, n)?,
        speed::inverse(args.seed, n)?,
        speed::verdict(args.seed, n)?,
        speed_reach::maps(args.seed, 1_000 * n)?,
        speed_reach::methods(args.seed)?,
        speed_reach::queries(args.seed, n)?,
        speed_bip::filters(args.seed)?,
        speed_scene::build_quality(args.seed, n, args.scene.as_deref())?,
        speed_contact::estimators(args.seed)?,
        speed_contact_knobs::learned(args.seed)?,
        speed_contact_fusion::fusion(args.seed)?,
        speed_texture::tessellation()?,
        speed_roughness::calibrations(args.seed, n)?,
        speed::dynamics(args.seed, n)?,
    ];
    for section in &sections {
        writeln!(io::stdout(), "{}", section.text)?;
        text.push('\n');
        text.push_str(&section.text);
        if let Some(figure) = &section.figure {
            figure.draw(&figures)?;
            text.push_str(&figure.markdown());
        }
    }
    let path = args.out.join("SPEED-AGAINST-ERROR.md");
    std::fs::write(&path, text)?;
    if let Some(readme) = &args.readme {
        speed::update_readme(readme, &machine, &sections)?;
    }
    writeln!(
        io::stdout(),
        "wrote {} and {}",
        path.display(),
        figures.display()
    )?;
    Ok(())
}
