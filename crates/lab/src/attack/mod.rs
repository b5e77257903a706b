//! Attacks: hostile inputs, made from good ones, for all file readers, and random faults in the control loop.

mod binary;
pub mod findings;
mod session;
mod study_log;
mod text;

use crate::documents::Documents;
use crate::faults::random;
use crate::report::{Gap, page};
use anyhow::bail;
use hwall_testkit::{AttackReport, Column, Verdict, attack, table_of};
use std::path::PathBuf;

/// A target of an attack.
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    /// `None`: the disturbed control loop.
    reader: Option<Reader>,
}

/// A reader, its contract, and inputs that it accepts.
struct Reader {
    good: Vec<Vec<u8>>,
    read: Box<Read>,
}

/// Reads an input and checks the result.
type Read = dyn Fn(&[u8]) -> Verdict;

impl Reader {
    fn new(good: Vec<Vec<u8>>, read: impl Fn(&[u8]) -> Verdict + 'static) -> anyhow::Result<Self> {
        let read = Box::new(read);
        Ok(Self { good, read })
    }
}

impl Target {
    /// Gives a reader `inputs` hostile inputs, or disturbs the loop in `runs` runs.
    ///
    /// # Errors
    /// A good input that is rejected, which makes the attack meaningless; a loop that cannot be set up.
    pub fn attack(&self, inputs: u64, runs: u64, seed: u64) -> anyhow::Result<AttackReport> {
        let Some(Reader { good, read }) = &self.reader else {
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

/// Creates a reader; some of its good inputs take time to create.
type Prepare = fn() -> anyhow::Result<Reader>;

const READERS: [(&str, Prepare); 14] = [
    ("scene", text::scene),
    ("hand", text::hand),
    ("urdf", text::urdf),
    ("study", text::study),
    ("log", study_log::log),
    ("calibration", text::calibration),
    ("headset", text::headset),
    ("model", text::model),
    ("map", binary::map),
    ("atlas", binary::atlas),
    ("stl", binary::stl),
    ("exr", binary::exr),
    ("png", binary::png),
    ("session", session::session),
];

/// Name of the control loop among the targets.
pub const LOOP: &str = "loop";

/// All readers and the loop, or the one of this name.
///
/// # Errors
/// No reader of that name; a good input that cannot be created.
pub fn targets(name: &str) -> anyhow::Result<Vec<Target>> {
    let mut targets = Vec::new();
    for (own, reader) in READERS {
        if [own, "all"].contains(&name) {
            let reader = Some(reader()?);
            targets.push(Target { name: own, reader });
        }
    }
    if [LOOP, "all"].contains(&name) {
        let (name, reader) = (LOOP, None);
        targets.push(Target { name, reader });
    }
    if targets.is_empty() {
        let names = READERS.map(|(name, _)| name).join(", ");
        bail!("--reader {name}: expected all or one of {names}, {LOOP}");
    }
    Ok(targets)
}

/// Repeats one run of the control loop, with the other runs on its arm.
///
/// # Errors
/// A loop that cannot be set up.
pub fn loop_again(run: u64, seed: u64) -> anyhow::Result<AttackReport> {
    random::attack_again(run, seed)
}

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
    let gaps: [Gap<'_>; 2] = [
        ("table", &table(reports)),
        ("findings", &findings::section()),
    ];
    documents.write(NAME, &page(include_str!("document.md"), seed, &gaps)?)
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
