//! The whole of docs/SPEED-AGAINST-ERROR.md, and what docs/CRATES.md and the README quote of it.

use crate::documents::{Documents, renew_block, renew_words, written_by};
use crate::speed::connect::measured as connect;
use crate::speed::contact::{estimators, fusion};
use crate::speed::page::section::{Section, summary_table};
use crate::speed::{bip, control_step, feel, kinematics, reach, roughness, scene, texture};
use anyhow::Context;
use hwall_testkit::{Machine, Yardstick};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The name of the document.
pub const NAME: &str = "SPEED-AGAINST-ERROR.md";
/// The document with the summary of it, and the block that holds it.
const SUMMARY: (&str, &str) = ("CRATES.md", "speed");
/// The row of the summary that the README quotes, and where.
const QUOTED: (&str, &str) = ("control step, 9 upright pieces", "control-step");

/// What to measure with.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// Everything is drawn from it.
    pub seed: u64,
    /// Targets per row.
    pub targets: usize,
    /// OBJ file for the ray casts; the built-in room full of bumpy balls without one.
    pub scene: Option<&'a Path>,
}

/// Measures everything and writes the document with its figures; the tables are shown on `out`.
/// The summary in `readme` is renewed and, if the documents are the tracked ones, the one in docs/CRATES.md with what the
/// tracked README quotes of it.
/// Returns the path of the document.
///
/// # Errors
/// A measurement that fails, a file that cannot be written.
pub fn write(
    request: &Request<'_>,
    documents: &Documents,
    readme: Option<&Path>,
    out: &mut impl Write,
) -> anyhow::Result<PathBuf> {
    let &Request {
        seed,
        targets: n,
        scene,
    } = request;
    let figures = documents.figures("")?;
    let machine = Machine::detect(seed);
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
        timed(reach::methods(seed)?),
        timed(reach::queries(seed, n)?),
        timed(bip::filters(seed)?),
        timed(scene::build_quality(seed, n, scene)?),
        timed(estimators::estimators(seed)?),
        timed(fusion::fusion(seed)?),
        timed(texture::tessellation()?),
        timed(roughness::calibrations(seed, n)?),
        timed(kinematics::dynamics(seed, n)?),
        timed(feel::feel(seed, n)?),
        timed(control_step::control_step(seed, 500 * n)?),
        timed(connect::connect(seed, n)?),
    ];
    let mut text = format!(
        "# Speed against error\n\n{}\n\n{machine}\n\n{yardstick}.\n\nMedian and p99 are per call; calls below a microsecond are timed in batches, \
         so their p99 is over batches. Errors are against the exact answer named with each table.\n",
        written_by()
    );
    for section in &sections {
        writeln!(out, "{}", section.text).context("standard output")?;
        text.push('\n');
        text.push_str(&section.text);
        if let Some(figure) = &section.figure {
            figure.draw(&figures)?;
            text.push_str(&figure.markdown());
        }
    }
    let path = documents.write(NAME, &text)?;
    let header = format!("{machine}\n\n{yardstick}.");
    if let Some(readme) = readme {
        renew_summary(readme, &header, &sections)?;
    }
    if let Some(front_page) = documents.readme() {
        renew_summary(&documents.folder().join(SUMMARY.0), &header, &sections)?;
        renew_front_page(front_page, &sections)?;
    }
    Ok(path)
}

/// Replaces the summary in a file by rows of these sections.
fn renew_summary(file: &Path, header: &str, sections: &[Section]) -> anyhow::Result<()> {
    let table = summary_table(sections);
    renew_block(file, SUMMARY.1, &format!("{header}\n\n{table}"))
}

/// Replaces the figure that the README quotes.
fn renew_front_page(readme: &Path, sections: &[Section]) -> anyhow::Result<()> {
    let mut rows = sections.iter().flat_map(|section| &section.summary);
    let row = rows.find(|row| row.what == QUOTED.0);
    let row = row.with_context(|| format!("no row {:?} to quote", QUOTED.0))?;
    let figure = format!("median {}, p99 {}", row.median, row.p99);
    renew_words(readme, QUOTED.1, &figure)
}
