//! Attacks: hostile inputs, made from good ones, for everything that reads files, and faults at random in the control loop.

mod binary;
pub mod findings;
mod session;
mod study_log;
mod text;

use crate::documents::{Documents, written_by};
use crate::faults::random;
use anyhow::bail;
use hwall_testkit::{AttackReport, Machine, MarkdownTable, Verdict, attack};
use std::path::PathBuf;

/// Reads an input and checks what was read.
type Read = Box<dyn Fn(&[u8]) -> Verdict>;

/// What is attacked.
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    kind: Kind,
}

enum Kind {
    /// A reader, what it promises, and inputs that it accepts.
    Reader { good: Vec<Vec<u8>>, read: Read },
    /// The control loop, disturbed.
    Loop,
}

impl Target {
    fn new(
        name: &'static str,
        good: Vec<Vec<u8>>,
        read: impl Fn(&[u8]) -> Verdict + 'static,
    ) -> Self {
        Self {
            name,
            kind: Kind::Reader {
                good,
                read: Box::new(read),
            },
        }
    }

    /// Gives a reader that many hostile inputs, or disturbs the loop in that many runs.
    ///
    /// # Errors
    /// A good input that is not accepted: the attack would prove nothing. A loop that cannot be set up.
    pub fn attack(&self, inputs: u64, runs: u64, seed: u64) -> anyhow::Result<AttackReport> {
        let (good, read) = match &self.kind {
            Kind::Reader { good, read } => (good, read),
            Kind::Loop => return random::attack(runs, seed),
        };
        for good in good {
            if read(good) != Verdict::Accepted {
                bail!("{}: an input that is good was not accepted", self.name);
            }
        }
        Ok(attack(self.name, good, inputs, seed, read))
    }
}

/// Names of the readers, and of what is no reader.
const NAMES: [&str; 14] = [
    "scene",
    "hand",
    "urdf",
    "study",
    "log",
    "calibration",
    "model",
    "regions",
    "map",
    "atlas",
    "stl",
    "exr",
    "session",
    LOOP,
];

/// Name of the control loop among them.
pub const LOOP: &str = "loop";

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
        "log" => study_log::log()?,
        "calibration" => text::calibration(),
        "model" => text::model(),
        "regions" => text::regions()?,
        "map" => binary::map()?,
        "atlas" => binary::atlas()?,
        "stl" => binary::stl()?,
        "exr" => binary::exr()?,
        "session" => session::session()?,
        LOOP => Target {
            name: LOOP,
            kind: Kind::Loop,
        },
        _ => bail!(
            "--reader {name}: expected all or one of {}",
            NAMES.join(", ")
        ),
    })
}

/// One run of the control loop once more, with the others on its arm.
///
/// # Errors
/// A loop that cannot be set up.
pub fn loop_again(run: u64, seed: u64) -> anyhow::Result<AttackReport> {
    random::attack_again(run, seed)
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
        "# Attacks\n\nWhat becomes of hostile files, and of the control loop under faults? {}\n\n{}\n\n{}\n{EXPLAINED}\n{}",
        written_by(),
        Machine::detect(seed),
        table(reports),
        findings::section()
    );
    documents.write(NAME, &text)
}

/// How inputs are made, and what counts as a finding.
const EXPLAINED: &str = "\
Inputs are made from files that are accepted: bits are flipped, ends cut off, pieces of two files joined, numbers made extreme, lines
repeated, counts made huge; checksums and digests are made right again. A finding is a panic, or something that was accepted and does
not hold what it promises: a hit that is not finite, a model that cannot read its own file, a probability above 1. The slowest input
counts its waiting for the processor, too.

The control loop is disturbed again and again while it serves one touch after another, at servo level and at torque level, with a wall,
a textured wall and a door: one of the faults of [FAULTS.md](FAULTS.md), or one wrong number in the arm's state or the tracker's frame
(from NaN and 1e300 to 0.001), or both, for 1 to 400 cycles at a moment drawn at random. The hand is in a hurry: it sets off 0.2 to 1.4 s
after its look, takes 0.2 to 1 s, and touches up to 0.3 m beside the usual place, so it often meets the board on its way. *Refused*
means that a safe state was named, *accepted* that the session went on. A finding is a command outside the joints' limits or faster
than they may be, one far from the arm, a step that looks at more instants of possible ways than it may (counted, for times depend on
the machine), a latch without a fault, one that a reset does not open, a touch afterwards that is not served, or a panic.
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
