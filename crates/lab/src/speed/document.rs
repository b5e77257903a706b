//! The whole of docs/SPEED-AGAINST-ERROR.md, and the README's excerpt of it.

use crate::documents::{Documents, renew_block, written_by};
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
/// The block of the README that quotes it.
const BLOCK: &str = "speed";

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
/// The block of `readme` and, if the documents are the tracked ones, of the tracked README is renewed.
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
    for readme in readme.into_iter().chain(documents.readme()) {
        renew_excerpt(readme, &format!("{machine}\n\n{yardstick}."), &sections)?;
    }
    Ok(path)
}

/// Replaces the excerpt in a README by rows of these sections.
fn renew_excerpt(readme: &Path, header: &str, sections: &[Section]) -> anyhow::Result<()> {
    let table = summary_table(sections);
    renew_block(readme, BLOCK, &format!("{header}\n\n{table}"))
}
