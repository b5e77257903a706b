//! Attacks on everything that reads files: hostile inputs from good ones, and what became of them.

mod binary;
mod session;
mod text;

use crate::documents::Documents;
use anyhow::bail;
use hwall_testkit::{AttackReport, Machine, MarkdownTable, Verdict, attack};
use std::path::PathBuf;

/// Reads an input and checks what was read.
type Read = Box<dyn Fn(&[u8]) -> Verdict>;

/// A reader, what it promises, and inputs that it accepts.
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    good: Vec<Vec<u8>>,
    read: Read,
}

impl Target {
    fn new(
        name: &'static str,
        good: Vec<Vec<u8>>,
        read: impl Fn(&[u8]) -> Verdict + 'static,
    ) -> Self {
        Self {
            name,
            good,
            read: Box::new(read),
        }
    }

    /// Gives it hostile inputs.
    ///
    /// # Errors
    /// A good input that is not accepted: the attack would prove nothing.
    pub fn attack(&self, inputs: u64, seed: u64) -> anyhow::Result<AttackReport> {
        for good in &self.good {
            if (self.read)(good) != Verdict::Accepted {
                bail!("{}: an input that is good was not accepted", self.name);
            }
        }
        Ok(attack(self.name, &self.good, inputs, seed, &self.read))
    }
}

/// Names of the readers.
const NAMES: [&str; 11] = [
    "scene",
    "hand",
    "urdf",
    "study",
    "calibration",
    "model",
    "map",
    "atlas",
    "stl",
    "exr",
    "session",
];

/// All readers, or the one of this name.
///
/// # Errors
/// No reader of that name; an input to begin with that cannot be made.
pub fn targets(name: &str) -> anyhow::Result<Vec<Target>> {
    if name == "all" {
        return NAMES.into_iter().map(target).collect();
    }
    Ok(vec![target(name)?])
}

fn target(name: &str) -> anyhow::Result<Target> {
    Ok(match name {
        "scene" => text::scene(),
        "hand" => text::hand(),
        "urdf" => text::urdf(),
        "study" => text::study(),
        "calibration" => text::calibration(),
        "model" => text::model(),
        "map" => binary::map()?,
        "atlas" => binary::atlas()?,
        "stl" => binary::stl()?,
        "exr" => binary::exr()?,
        "session" => session::session()?,
        _ => bail!(
            "--reader {name}: expected all or one of {}",
            NAMES.join(", ")
        ),
    })
}

/// A row for each attack.
#[must_use]
pub fn table(reports: &[AttackReport]) -> String {
    let mut table = MarkdownTable::new([
        "attack",
        "inputs",
        "refused",
        "accepted",
        "findings",
        "slowest ms",
    ]);
    for report in reports {
        table.row([
            report.name.clone(),
            report.inputs.to_string(),
            report.refused.to_string(),
            report.accepted.to_string(),
            report.findings.to_string(),
            format!("{:.1}", report.slowest_ms),
        ]);
    }
    table.to_string()
}

/// Name of the document.
pub const NAME: &str = "ATTACKS.md";

/// Writes the table with what was done into the document.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    reports: &[AttackReport],
    seed: u64,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let text = format!(
        "# Attacks\n\nWhat becomes of hostile files? Written by `cargo run --release --example attack -- --docs`; not edited by \
         hand.\n\n{}\n\n{}\n{EXPLAINED}",
        Machine::detect(seed),
        table(reports)
    );
    documents.write(NAME, &text)
}

/// How inputs are made, and what counts as a finding.
const EXPLAINED: &str = "\
Inputs are made from files that are accepted: bits are flipped, ends cut off, pieces of two files joined, numbers made extreme, lines
repeated, counts made huge; checksums and digests are made right again. A finding is a panic, or something that was accepted and does
not hold what it promises: a hit that is not finite, a model that cannot read its own file, a probability above 1. The slowest input
counts its waiting for the processor, too.

What the control loop does under faults: [FAULTS.md](FAULTS.md), and the named attacks in `crates/hwall/tests/loop_attacks.rs`.
";

/// A promise, and whether it holds.
fn promise(holds: bool, what: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what.to_owned()) }
}

/// The verdict about something that was read.
fn judged<T, E>(read: Result<T, E>, check: impl FnOnce(T) -> Result<(), String>) -> Verdict {
    match read.map(check) {
        Err(_) => Verdict::Refused,
        Ok(Ok(())) => Verdict::Accepted,
        Ok(Err(what)) => Verdict::Broken(what),
    }
}
