//! What `contact_study` can be asked for.

use crate::contact::candidates as contact_candidates;
use crate::contact::dissertation::{self as contact_dissertation, Choice};
use crate::contact::document as contact_document;
use crate::contact::report as contact_report;
use crate::demonstrations::files::{Robot, generate_into};
use crate::demonstrations::generate::DemonstrationConfig;
use crate::rooms::study as contact_rooms_study;
use anyhow::{Context, bail};
use clap::{Parser, ValueEnum};
use std::path::{Path, PathBuf};

/// Compares estimators of where and when a hand touches, on reaches that they were not trained with.
///
/// Recordings are CSV files, one row a sample, metres and seconds: t, columns NAME_x, NAME_y, NAME_z of
/// any of palm, thumb, index, middle, ring, little, head, gaze, target, and optionally person, trial,
/// contact (0 or 1). With a person column one person at a time is held out.
#[derive(Parser)]
pub struct Arguments {
    /// A recording, or a folder: every CSV file under it
    #[arg(long)]
    recordings: Option<PathBuf>,
    /// Simulated people instead of recordings [default: dissertation]
    #[arg(long, value_enum)]
    protocol: Option<Protocol>,
    /// Only write the demonstrations of the protocol into this folder
    #[arg(long)]
    generate: Option<PathBuf>,
    /// Folder for predictions (one row each), scores and figures
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write dissertation and rooms into this document instead, with the recordings if they are named
    #[arg(long)]
    report: Option<PathBuf>,
    /// Seed of the simulated people [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// Simulated people to learn from [default: that of the protocol]
    #[arg(long)]
    people: Option<usize>,
    /// Reaches of all of them together [default: that of the protocol]
    #[arg(long)]
    reaches: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// 47 reaches to learn from, 30 of other people to be judged by, one static panel
    Dissertation,
    /// Pointing in the air, 1,625 reaches of 13 people, each person held out
    Pointing,
    /// Rooms of 1, 3, 6 and 12 surfaces, and one of them under worse and worse conditions
    Rooms,
}

impl Arguments {
    /// From the words of a command line, the first of which is the program.
    ///
    /// # Errors
    /// Words that mean nothing, in many lines.
    pub fn of<'a>(words: impl IntoIterator<Item = &'a str>) -> anyhow::Result<Self> {
        Ok(Self::try_parse_from(words)?)
    }

    /// Does what is asked for, and says what came of it.
    ///
    /// # Errors
    /// What does not go together, a recording that cannot be read, a file that cannot be written; no empty
    /// folder for results is left behind.
    pub fn run(&self) -> anyhow::Result<String> {
        self.check()?;
        let choice = Choice {
            seed: self.seed.unwrap_or(1),
            people: self.people,
            reaches: self.reaches,
        };
        let protocol = self.protocol.unwrap_or(Protocol::Dissertation);
        if let Some(folder) = &self.generate {
            let config = choice.of(match protocol {
                Protocol::Pointing => DemonstrationConfig::pointing(),
                _ => DemonstrationConfig::dissertation(),
            });
            let made = generate_into(folder, &config, Robot::default())?;
            return Ok(made + "\n");
        }
        let out = self.out.as_deref();
        let candidates = contact_candidates::all();
        in_folder(out, || {
            if let Some(file) = &self.report {
                let recordings = self.recordings.as_deref();
                contact_document::write(file, choice, &candidates, recordings, out)?;
                return Ok(format!("wrote {}\n", file.display()));
            }
            match (&self.recordings, protocol) {
                (Some(path), _) => contact_report::recordings(path, &candidates, out),
                (None, Protocol::Dissertation) => {
                    contact_dissertation::report(choice, &candidates, out)
                }
                (None, Protocol::Rooms) => contact_rooms_study::report(choice.seed, out),
                (None, Protocol::Pointing) => {
                    contact_dissertation::pointing(choice, &candidates, out)
                }
            }
        })
    }

    /// Nothing that is asked for is passed over in silence.
    fn check(&self) -> anyhow::Result<()> {
        let people = [
            ("--people", self.people.is_some()),
            ("--reaches", self.reaches.is_some()),
        ];
        let seed = ("--seed", self.seed.is_some());
        let protocol = ("--protocol", self.protocol.is_some());
        let refuse = |given: &[(&str, bool)], why: &str| match given.iter().find(|g| g.1) {
            Some((name, _)) => bail!("{name}: {why}"),
            None => Ok(()),
        };
        if self.generate.is_some() {
            let others = [
                ("--recordings", self.recordings.is_some()),
                ("--report", self.report.is_some()),
                ("--out", self.out.is_some()),
            ];
            refuse(
                &others,
                "not with --generate, which only makes demonstrations",
            )?;
        }
        if self.report.is_some() {
            refuse(
                &[protocol],
                "not with --report, which has its own protocols",
            )?;
        } else if self.recordings.is_some() {
            let simulated = [people[0], people[1], seed, protocol];
            refuse(
                &simulated,
                "of simulated people, --recordings has none (without --report)",
            )?;
        }
        if self.protocol == Some(Protocol::Rooms) {
            let generate = ("--generate", self.generate.is_some());
            let others = [people[0], people[1], generate];
            refuse(&others, "--protocol rooms takes --seed and --out alone")?;
        }
        Ok(())
    }
}

/// Works with this folder made; what was made for nothing is taken away again.
fn in_folder<T>(
    folder: Option<&Path>,
    work: impl FnOnce() -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let Some(folder) = folder else { return work() };
    let new = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
    let made: Vec<&Path> = folder.ancestors().take_while(new).collect();
    let done = std::fs::create_dir_all(folder)
        .with_context(|| folder.display().to_string())
        .and_then(|()| work());
    if done.is_err() {
        // A folder that holds something is not removed, nor any above it.
        let _ = made.into_iter().try_for_each(std::fs::remove_dir);
    }
    done
}
