//! The flags of `contact_study`, the requested study, and the document of all its protocols.

use crate::contact::candidates::{self, Candidate};
use crate::contact::dissertation::{self, Overrides};
use crate::contact::recordings::Recorded;
use crate::contact::report::{self, Choice};
use crate::contact::{panels, tables};
use crate::documents::Documents;
use crate::report::page;
use crate::rooms::{objects, study};
use anyhow::{Context, bail, ensure};
use clap::{Parser, ValueEnum};
use hwall_contact::{Frame, LearnedConfig};
use hwall_hand::NamedPoint;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::recording_units::RecordingUnits;
use hwall_stage::numbers::count_within;
use std::path::{Path, PathBuf};

/// Default folder of --report, and folder for the tables of --docs.
const OUT: &str = "out/contact_study";

/// Compares estimators of where and when a hand touches, on held-out reaches.
///
/// Recordings are CSV files, one row per sample, in metres and seconds (or --hand-scale, --time-unit): t, columns NAME_x, NAME_y, NAME_z of
/// any of palm, thumb, index, middle, ring, little, wrist, forearm, elbow, shoulder, grip, aim, head, gaze, target, and
/// optionally person, trial, contact (0 or 1). With a person column, one person at a time is held out.
#[derive(Parser)]
pub struct Arguments {
    /// A recording, or a folder with CSV files
    #[arg(long, group = "recorded")]
    recordings: Option<PathBuf>,
    /// Units of the recordings.
    #[command(flatten)]
    units: RecordingUnits,
    /// Trials of the recording, metres and seconds: predicts in scenes of a panel at the end of each reach and the boxes of the other
    /// objects. Columns person, trial, scene, target, cx, cy, cz, sx, sy, sz, dur, rx, ry, rz
    #[arg(long, value_name = "FILE", requires = "recordings", conflicts_with_all = ["report", "docs", "out", "points", "gaze", "hand_scale", "time_unit"])]
    panels: Option<PathBuf>,
    /// Panels with the touch in their middle, instead of up to 0.12 m from it
    #[arg(long, requires = "panels")]
    centred: bool,
    /// Simulated people instead of recordings [default: dissertation]
    #[arg(long, value_enum)]
    protocol: Option<Protocol>,
    /// Folder for predictions (one row each), scores and figures
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write all protocols into a page instead, with a second file for their tables, and include the recordings if given [default:
    /// out/contact_study/CONTACT-STUDY.md]
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    report: Option<Option<PathBuf>>,
    /// Overwrite the tracked documents in docs/ with these; figures, predictions and scores go to out/contact_study
    #[arg(long, conflicts_with_all = ["report", "out"])]
    docs: bool,
    /// Seed of the simulated people [default: 1]
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Number of simulated people to learn from [default: that of the protocol]
    #[arg(long, value_parser = count_within::<1, 10_000>, allow_negative_numbers = true)]
    people: Option<usize>,
    /// Total number of their reaches [default: that of the protocol]
    #[arg(long, value_parser = count_within::<1, 100_000>, allow_negative_numbers = true)]
    reaches: Option<usize>,
    /// Regions of progress of the learned estimator [default: chosen on held-out reaches]
    #[arg(long, value_parser = count_within::<1, 1_000>, allow_negative_numbers = true)]
    regions: Option<usize>,
    /// Number of past positions that it compares with the present one, 0 to 8 [default: 4]
    #[arg(long, value_parser = count_within::<0, 8>, allow_negative_numbers = true)]
    lags: Option<usize>,
    /// Points that estimators may see in addition to the touching one, separated by commas: palm, thumb, index, middle, ring, little,
    /// wrist, forearm, elbow, shoulder, grip, aim [default: all]
    #[arg(long, value_delimiter = ',', value_parser = named_point)]
    points: Option<Vec<NamedPoint>>,
    /// Frame of the learned estimator [default: auto]
    #[arg(long, value_enum)]
    frame: Option<FrameChoice>,
    /// Lets the learned estimator see the gaze
    #[arg(long)]
    gaze: bool,
    /// auto: choose all settings of the learned estimator on held-out reaches, as without these flags
    #[arg(long, value_parser = ["auto"], conflicts_with_all = ["regions", "lags", "frame", "gaze"])]
    settings: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrameChoice {
    /// Both, weighted by evidence
    Auto,
    /// Only the room
    Room,
    /// Only the start of the reach
    Start,
}

fn named_point(name: &str) -> Result<NamedPoint, String> {
    NamedPoint::named(name).ok_or_else(|| {
        let known = NamedPoint::ALL.map(NamedPoint::name).join(", ");
        format!("no point that is known ({known})")
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// 47 training reaches, 30 test reaches by other people, one static panel
    Dissertation,
    /// Pointing in the air, 1,625 reaches of 13 people, each person held out
    Pointing,
    /// Rooms of 1, 3, 6 and 12 surfaces, and one of them under worse conditions
    Rooms,
    /// A room of 12 different objects: which one is touched, and what it will feel like
    Objects,
}

impl Arguments {
    /// From the words of a command line, the first of which is the program.
    ///
    /// # Errors
    /// Unknown flags or values; the message has several lines.
    pub fn of<'a>(words: impl IntoIterator<Item = &'a str>) -> anyhow::Result<Self> {
        Ok(Self::try_parse_from(words)?)
    }

    /// Runs the request, and returns the text to show.
    ///
    /// # Errors
    /// Flags that do not go together, a recording that cannot be read, a file that cannot be written; no empty
    /// folder for results is left behind.
    pub fn run(&self) -> anyhow::Result<String> {
        self.check()?;
        let report = self.report.as_ref().and_then(|file| file.as_deref());
        FilePlan::default()
            .read("--recordings", self.recordings.as_deref())
            .read("--panels", self.panels.as_deref())
            .write("--report", report)
            .write_into("--out", self.out.as_deref(), &[])
            .check()?;
        let overrides = Overrides {
            seed: self.seed.unwrap_or(1),
            people: self.people,
            reaches: self.reaches,
        };
        let protocol = self.protocol.unwrap_or(Protocol::Dissertation);
        if let (Some(stream), Some(trials)) = (&self.recordings, &self.panels) {
            return self.in_rooms(stream, trials);
        }
        let candidates = candidates::all(self.config());
        if self.docs {
            return self.write_tracked(overrides, &candidates);
        }
        let out = self.out.as_deref();
        let choice = Choice {
            points: self.points.clone(),
            gaze: self.gaze,
        };
        in_folder(out, || {
            if let Some(file) = &self.report {
                return self.write_report(file.as_deref(), overrides, &candidates);
            }
            let section = match (self.recorded(), protocol) {
                (Some(recorded), _) => report::recordings(recorded, &candidates, &choice, out),
                (None, Protocol::Dissertation) => {
                    dissertation::report(overrides, &candidates, &choice, out)
                }
                (None, Protocol::Pointing) => {
                    dissertation::pointing(overrides, &candidates, &choice, out)
                }
                (None, Protocol::Rooms) => return study::report(overrides.seed),
                (None, Protocol::Objects) => return objects::report(overrides.seed),
            };
            Ok(section?.text)
        })
    }

    /// Predictions on recorded reaches in scenes.
    fn in_rooms(&self, stream: &Path, trials: &Path) -> anyhow::Result<String> {
        let trials = panels::read_files(stream, trials)?;
        panels::report(&trials, &self.config(), self.centred)
    }

    /// The requested learned estimator.
    fn config(&self) -> LearnedConfig {
        let nominal = LearnedConfig::default();
        LearnedConfig {
            regions: self.regions,
            lags: self.lags.unwrap_or(nominal.lags),
            frame: match self.frame {
                None | Some(FrameChoice::Auto) => Frame::Both,
                Some(FrameChoice::Room) => Frame::Room,
                Some(FrameChoice::Start) => Frame::Start,
            },
            gaze: self.gaze,
            ..nominal
        }
    }

    /// Writes the document to a file, or to its default place in `out/`.
    fn write_report(
        &self,
        file: Option<&Path>,
        overrides: Overrides,
        candidates: &[Candidate],
    ) -> anyhow::Result<String> {
        let file = match file {
            Some(file) => file.to_owned(),
            None => Documents::in_folder(OUT)?.folder().join(NAME),
        };
        let recorded = self.recorded();
        write_both(&file, overrides, candidates, recorded, self.out.as_deref())?;
        Ok(format!("wrote {}\n", file.display()))
    }

    fn recorded(&self) -> Option<Recorded<'_>> {
        let path = self.recordings.as_deref()?;
        let units = self.units;
        Some(Recorded { path, units })
    }

    /// Writes the tracked documents; figures and per-prediction data are not tracked.
    fn write_tracked(
        &self,
        overrides: Overrides,
        candidates: &[Candidate],
    ) -> anyhow::Result<String> {
        let (tracked, rest) = (Documents::tracked()?, Documents::in_folder(OUT)?);
        let file = tracked.folder().join(NAME);
        let out = rest.folder();
        write_both(&file, overrides, candidates, self.recorded(), Some(out))?;
        Ok(format!(
            "wrote {}; figures, predictions and scores are in {}\n",
            file.display(),
            out.display()
        ))
    }

    /// Refuses flags that would have no effect.
    fn check(&self) -> anyhow::Result<()> {
        let learned = [
            ("--regions", self.regions.is_some()),
            ("--lags", self.lags.is_some()),
            ("--points", self.points.is_some()),
            ("--frame", self.frame.is_some()),
            ("--gaze", self.gaze),
            ("--settings", self.settings.is_some()),
        ];
        let protocol = ("--protocol", self.protocol.is_some());
        let people = ("--people", self.people.is_some());
        let reaches = ("--reaches", self.reaches.is_some());
        let seed = ("--seed", self.seed.is_some());
        let out = ("--out", self.out.is_some());
        let documents = self.report.is_some() || self.docs;
        let recorded = self.recordings.is_some() && !documents;
        let rooms = matches!(self.protocol, Some(Protocol::Rooms | Protocol::Objects));
        for (applies, refused, why) in [
            (
                documents,
                &learned[..],
                "not with --report or --docs, which show the usual estimator",
            ),
            (
                rooms,
                &learned,
                "only where estimators are compared on reaches",
            ),
            (
                documents,
                &[protocol],
                "not with --report or --docs, which have their own protocols",
            ),
            (
                recorded,
                &[people, reaches, seed, protocol],
                "only for simulated people, --recordings has none (without --report or --docs)",
            ),
            (
                rooms,
                &[people, reaches, out],
                "--protocol rooms and objects take --seed alone",
            ),
        ] {
            if let Some((flag, _)) = refused.iter().find(|(_, given)| applies && *given) {
                bail!("{flag}: {why}");
            }
        }
        Ok(())
    }
}

/// Creates a folder and runs the work; if that fails, removes created folders that stayed empty.
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
        // A non-empty folder is not removed, nor any above it.
        let _ = made.into_iter().try_for_each(std::fs::remove_dir);
    }
    done
}

/// The name of the page.
pub const NAME: &str = "CONTACT-STUDY.md";
/// The name of the document with its tables.
pub const TABLES: &str = "CONTACT-TABLES.md";
/// Reaches of the simulated study of pointing in the document: a third of the full study.
const POINTING_REACHES: usize = 13 * 40;
/// Least number of reaches for a learning curve.
const LEAST_FOR_A_CURVE: usize = 200;

/// Writes the page, and a second document with all tables, including the recordings if given. Figures, scores and predictions go
/// to `out`.
///
/// # Errors
/// A protocol that fails, a file that cannot be written.
fn write_both(
    file: &Path,
    overrides: Overrides,
    candidates: &[Candidate],
    recorded: Option<Recorded<'_>>,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    // Check before minutes of work, not after.
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
    ensure!(
        folder.is_none_or(Path::is_dir) && !file.is_dir(),
        "{}: no file can be written there",
        file.display()
    );
    let all = Choice::default();
    let pointing = Overrides {
        reaches: overrides.reaches.or(Some(POINTING_REACHES)),
        ..overrides
    };
    let mut sections = vec![
        dissertation::report(overrides, candidates, &all, out)?,
        dissertation::pointing(pointing, candidates, &all, out)?,
    ];
    if let Some(recorded) = recorded {
        sections.push(report::recordings(recorded, candidates, &all, out)?);
    }
    let rooms = study::report(overrides.seed)?;
    let texts: String = sections.iter().map(|s| s.text.clone() + "\n").collect();
    let sets: Vec<_> = sections.into_iter().flat_map(|s| s.sets).collect();
    let mut adapting = sets.iter().filter_map(|(name, scores)| {
        let (s, told) = scores.iter().find_map(|s| Some((s, s.told.as_ref()?)))?;
        let enough = told.reaches.len() >= LEAST_FOR_A_CURVE;
        let curve = tables::curve(&s.alone, told);
        enough.then(|| {
            format!("\n### What touches teach: {name}\n\n30 to 90 % of the time.\n\n{curve}")
        })
    });
    let text = page(include_str!("contact_study.md"), overrides.seed).fill(&[
        ("overview", &tables::overview(&sets)),
        // One set is enough.
        ("adapting", &adapting.next().unwrap_or_default()),
        ("rooms", &rooms.trim_end()),
    ])?;
    let tables = page(include_str!("contact_tables.md"), overrides.seed)
        .fill(&[("sections", &texts.trim_end())])?;
    for (path, text) in [
        (file.to_owned(), text),
        (file.with_file_name(TABLES), tables),
    ] {
        hwall_files::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}
