//! The whole of docs/SPEED-AGAINST-ERROR.md, and its quotes in docs/CRATES.md and the README.

use crate::documents::{Documents, renew_block, renew_words};
use crate::report::page;
use crate::speed::section::{Section, summary_table};
use crate::speed::{bip, contact, control_step, feel, kinematics, reach, scene, texture};
use anyhow::Context;
use hwall_stage::numbers::count_within;
use hwall_testkit::{Machine, Yardstick};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The name of the document.
pub const NAME: &str = "SPEED-AGAINST-ERROR.md";
/// The document with the summary, and the name of its block.
const SUMMARY: (&str, &str) = ("CRATES.md", "speed");
/// The row of the summary quoted in the README, and the name of its marker.
const QUOTED: (&str, &str) = ("control step, 9 upright pieces", "control-step");

/// Settings of the measurements.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Seed of every target
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Targets per row
    #[arg(long, default_value_t = 10_000, value_parser = count_within::<100, 1_000_000>, allow_negative_numbers = true)]
    pub targets: usize,
    /// OBJ file for the ray casts and closest points; default: the built-in room full of bumpy balls
    #[arg(long)]
    pub scene: Option<PathBuf>,
}

/// Measures everything and writes the document; shows the tables on `out`.
/// Renews the summary in `readme` and, if the documents are the tracked ones, the summary in docs/CRATES.md and its quote in the
/// tracked README.
/// Returns the path of the document.
///
/// # Errors
/// A measurement that fails, a file that cannot be written.
pub fn write(
    request: &Request,
    documents: &Documents,
    readme: Option<&Path>,
    out: &mut impl Write,
) -> anyhow::Result<PathBuf> {
    let (seed, n) = (request.seed, request.targets);
    let mut yardstick = Yardstick::default();
    let mut timed = |section: Section| {
        yardstick.measure();
        section
    };
    let sections = [
        timed(kinematics::forward(seed, n)?),
        timed(kinematics::inverse(seed, n)?),
        timed(kinematics::verdict(seed, n)?),
        timed(reach::maps(seed, 1_000 * n)?),
        timed(reach::queries(seed, n)?),
        timed(bip::filters(seed)?),
        timed(scene::queries(seed, n, request.scene.as_deref())?),
        timed(contact::estimators(seed)?),
        timed(contact::fusion(seed)?),
        timed(texture::tessellation()?),
        timed(kinematics::dynamics(seed, n)?),
        timed(feel::feel(seed, n)?),
        timed(control_step::control_step(seed, 500 * n)?),
    ];
    let mut shown = String::new();
    for section in &sections {
        writeln!(out, "{}", section.text).context("standard output")?;
        shown += &format!("\n{}", section.text);
    }
    let text = page(include_str!("document.md"), seed)
        .fill(&[("yardstick", &yardstick), ("sections", &shown)])?;
    // Before the document is written, which changes the tree.
    let machine = Machine::detect(seed);
    let path = documents.write(NAME, &text)?;
    let table = summary_table(&sections);
    let block = format!("{machine}\n\n{yardstick}.\n\n{table}");
    if let Some(readme) = readme {
        renew_block(readme, SUMMARY.1, &block)?;
    }
    if let Some(front_page) = documents.readme() {
        renew_block(&documents.folder().join(SUMMARY.0), SUMMARY.1, &block)?;
        renew_front_page(front_page, &sections)?;
    }
    Ok(path)
}

/// Replaces the figure that the README quotes.
fn renew_front_page(readme: &Path, sections: &[Section]) -> anyhow::Result<()> {
    let mut rows = sections.iter().flat_map(|section| &section.summary);
    let row = rows.find(|[_, what, ..]| what == QUOTED.0);
    let [_, _, median, p99, _] = row.with_context(|| format!("no row {:?} to quote", QUOTED.0))?;
    renew_words(readme, QUOTED.1, &format!("median {median}, p99 {p99}"))
}
