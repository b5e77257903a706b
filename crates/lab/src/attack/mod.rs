//! Attacks: hostile inputs, made from good ones, for all file readers, and random faults in the control loop.

mod binary;
pub mod findings;
mod session;
mod study_log;
mod text;

use crate::documents::Documents;
use crate::faults::random;
use crate::report::page;
use anyhow::bail;
use hwall_testkit::{AttackReport, Column, Verdict, attack, table_of};
use std::path::PathBuf;

/// A target of an attack.
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    /// Inputs that are accepted, and the reader; `None`: the disturbed control loop.
    reader: Option<(Vec<Vec<u8>>, Read)>,
}

/// Creates inputs that a reader accepts; some of them take time to create.
type Good = fn() -> Inputs;
type Inputs = anyhow::Result<Vec<Vec<u8>>>;

/// Reads an input and checks the result.
type Read = fn(&[u8]) -> Verdict;

impl Target {
    /// Gives a reader `inputs` hostile inputs, or disturbs the loop in `runs` runs.
    ///
    /// # Errors
    /// A good input that is rejected, which makes the attack meaningless; a loop that cannot be set up.
    pub fn attack(&self, inputs: u64, runs: u64, seed: u64) -> anyhow::Result<AttackReport> {
        let Some((good, read)) = &self.reader else {
            return random::attack(runs, seed);
        };
        for good in good {
            if read(good) != Verdict::Accepted {
                bail!("{}: an input that is good was not accepted", self.name);
            }
        }
        Ok(attack(self.name, good, inputs, seed, read))
    }
}

const READERS: [(&str, Good, Read); 14] = [
    ("scene", text::scenes, text::read_scene),
    ("hand", text::hands, text::read_hand),
    ("urdf", text::arms, text::read_arm),
    ("study", text::studies, text::read_study),
    ("log", study_log::logs, study_log::read),
    ("calibration", text::calibrations, text::read_calibration),
    ("headset", text::headsets, text::read_headset),
    ("model", text::models, text::read_model),
    ("map", binary::maps, binary::read_map),
    ("atlas", binary::atlases, binary::read_atlas),
    ("stl", binary::meshes, binary::read_stl),
    ("exr", binary::heights, binary::read_exr),
    ("png", binary::pictures, binary::read_png),
    ("session", session::recordings, session::read),
];

/// Name of the control loop among the targets.
pub const LOOP: &str = "loop";

/// All readers and the loop, or the one of this name.
///
/// # Errors
/// No reader of that name; a good input that cannot be created.
pub fn targets(name: &str) -> anyhow::Result<Vec<Target>> {
    let mut targets = Vec::new();
    let is_asked = |own| [own, "all"].contains(&name);
    for (own, good, read) in READERS {
        if is_asked(own) {
            let reader = Some((good()?, read));
            targets.push(Target { name: own, reader });
        }
    }
    if is_asked(LOOP) {
        let (name, reader) = (LOOP, None);
        targets.push(Target { name, reader });
    }
    if targets.is_empty() {
        let names = READERS.map(|(name, ..)| name).join(", ");
        bail!("--reader {name}: expected all or one of {names}, {LOOP}");
    }
    Ok(targets)
}

pub use crate::faults::random::attack_again as loop_again;

/// The table of attacks, one row each.
pub fn table(reports: &[AttackReport]) -> String {
    let columns: [Column<'_, &AttackReport>; 6] = [
        ("attack", &|r| r.name.clone()),
        ("inputs", &|r| r.inputs.to_string()),
        ("refused", &|r| r.refused.to_string()),
        ("accepted", &|r| r.accepted.to_string()),
        ("findings", &|r| r.findings.to_string()),
        ("slowest ms", &|r| format!("{:.1}", r.slowest_ms)),
    ];
    table_of(reports, &columns).to_string()
}

/// Name of the document.
pub const NAME: &str = "ATTACKS.md";

/// Writes the table and the parameters into the document.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    reports: &[AttackReport],
    seed: u64,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let text = page(include_str!("document.md"), seed).fill(&[
        ("table", &table(reports)),
        ("findings", &findings::section()),
    ])?;
    documents.write(NAME, &text)
}

/// Checks a condition of the contract.
fn promise(holds: bool, what: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what.to_owned()) }
}

/// The verdict on a read result.
fn judged<T, E>(read: Result<T, E>, check: impl FnOnce(T) -> Result<(), String>) -> Verdict {
    match read.map(check) {
        Err(_) => Verdict::Refused,
        Ok(Ok(())) => Verdict::Accepted,
        Ok(Err(what)) => Verdict::Broken(what),
    }
}

/// The verdict on a text.
fn judged_text<T, E>(
    bytes: &[u8],
    read: impl FnOnce(&str) -> Result<T, E>,
    check: impl FnOnce(T) -> Result<(), String>,
) -> Verdict {
    match std::str::from_utf8(bytes) {
        Ok(text) => judged(read(text), check),
        Err(_) => Verdict::Refused,
    }
}
