//! Labelled reaches from recorded hands.

use crate::bip::trajectories::csv_files;
use anyhow::{Context, ensure};
use hwall_contact::score::Split;
use hwall_hand::{
    HandError, HandPoint, LabelConfig, LabelledReach, Quantity, ReachCut, Recording,
    labelled_reaches, read_recordings,
};
use hwall_stage::input::recording_units::RecordingUnits;
use hwall_stage::numbers::counted;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

/// Files without trials are one trial each if half of those in the folder last no longer than this, s.
const LONGEST_TRIAL_S: f64 = 10.0;
/// File names reserved for the simulated protocols.
const TAKEN: [&str; 2] = ["dissertation", "pointing"];
/// Largest number of reasons listed in an error.
const MOST_REASONS: usize = 4;

/// Reaches of one study, all with the same points of the hand, in the frame of its tracker.
#[derive(Debug, Clone)]
pub struct Source {
    /// The folder or the file, for tables and names of figures.
    pub name: String,
    /// The recorded data, and their segmentation.
    pub description: String,
    /// The reaches.
    pub reaches: Vec<LabelledReach>,
    /// The recording that each reach is from.
    pub recordings: Vec<usize>,
    /// What was left out: count, reason, and first instance.
    pub left_out: Vec<String>,
    /// Ignored columns, in order of appearance.
    pub ignored_columns: Vec<String>,
}

/// The studies found in a file or folder.
#[derive(Debug, Clone)]
pub struct FoundSources {
    /// The studies, with unique names.
    pub sources: Vec<Source>,
    /// A line for each file that is not a recording of a hand.
    pub refused: Vec<String>,
}

/// Location and units of recordings.
#[derive(Debug, Clone, Copy)]
pub struct Recorded<'a> {
    /// A file or a folder.
    pub path: &'a Path,
    /// Units of all its files.
    pub units: RecordingUnits,
}

/// A path alone: in metres and seconds.
impl<'a, P: AsRef<Path> + ?Sized> From<&'a P> for Recorded<'a> {
    fn from(path: &'a P) -> Self {
        let (path, units) = (path.as_ref(), RecordingUnits::SI);
        Self { path, units }
    }
}

/// One file, and what is in it.
struct File {
    path: PathBuf,
    recordings: Vec<Recording>,
}

/// The study in a file, or all studies under a folder.
///
/// Files of one folder with the same quantities belong together. If several files have trials but no
/// person, each file is a person. If several files have neither, and half of them last no longer than ten
/// seconds, each file is one trial and only its first reach counts: the rest is the retraction.
/// All other data without trials are segmented by speed into reaches.
///
/// # Errors
/// Nothing found, or no recording of a hand in it.
pub fn read<'a>(recorded: impl Into<Recorded<'a>>) -> anyhow::Result<FoundSources> {
    let Recorded { path, units } = recorded.into();
    ensure!(path.exists(), "{}: no such file or folder", path.display());
    let (mut groups, mut refused) = (BTreeMap::<_, Vec<File>>::new(), Vec::new());
    let (dir, files) = match path.is_dir() {
        true => (path, csv_files(path, true)?),
        false => (path.parent().unwrap_or(path), vec![path.to_owned()]),
    };
    for path in files {
        let name = path.strip_prefix(dir).unwrap_or(&path).to_owned();
        match in_units(&path, units) {
            Ok(recordings) => {
                let folder = name.parent().map(Path::to_owned).unwrap_or_default();
                let key = (folder, quantities(&recordings));
                groups.entry(key).or_default().push(File {
                    path: name,
                    recordings,
                });
            }
            Err(error) => refused.push(format!("{}: {error}", name.display())),
        }
    }
    ensure!(
        !groups.is_empty(),
        "no readable recording in {}: {}",
        path.display(),
        reasons(&refused)
    );
    let folders: Vec<PathBuf> = groups.keys().map(|(folder, _)| folder.clone()).collect();
    let several = |folder: &PathBuf| folders.iter().filter(|f| *f == folder).count() > 1;
    let mut sources = Vec::new();
    let mut taken = BTreeSet::from(TAKEN.map(str::to_owned));
    for ((folder, _), files) in groups {
        let name = match folder.as_os_str().is_empty() || several(&folder) {
            true => files[0].path.with_extension(""),
            false => folder,
        };
        let name = unused(name.display().to_string(), &mut taken);
        let source = Source::of(name.clone(), files).with_context(|| name)?;
        sources.push(source);
    }
    Ok(FoundSources { sources, refused })
}

/// The recordings of a file, in metres and seconds. The file is refused if most of its recordings are in other units.
fn in_units(path: &Path, units: RecordingUnits) -> anyhow::Result<Vec<Recording>> {
    let mut recordings = read_recordings(std::fs::File::open(path)?)?;
    let mut odd = Vec::new();
    for recording in &mut recordings {
        odd.extend(units.apply(recording).err());
    }
    let are_most = 2 * odd.len() > recordings.len();
    match odd.into_iter().next() {
        Some(first) if are_most => Err(first),
        _ => Ok(recordings),
    }
}

/// A name not used by another study, ignoring case: the path with dashes, and a number if it is
/// `taken`.
fn unused(path: String, taken: &mut BTreeSet<String>) -> String {
    let plain = path.replace(['/', '\\'], "-");
    let mut name = plain.clone();
    let mut number = 2;
    while !taken.insert(name.to_lowercase()) {
        name = format!("{plain}-{number}");
        number += 1;
    }
    name
}

/// The reasons why nothing could be read, in one line.
fn reasons(refused: &[String]) -> String {
    if refused.is_empty() {
        return "no CSV file".to_owned();
    }
    let mut text = refused[..refused.len().min(MOST_REASONS)].join("; ");
    if let Some(more @ 1..) = refused.len().checked_sub(MOST_REASONS) {
        text += &format!("; and {more} more");
    }
    text
}

/// Names of the quantities that are recorded at least once.
fn quantities(recordings: &[Recording]) -> Vec<&'static str> {
    let seen = |q: &Quantity| {
        let mut samples = recordings.iter().flat_map(|r| &r.samples);
        samples.any(|s| s.get(*q).is_some())
    };
    let all = Quantity::ALL.into_iter();
    all.filter(seen).map(Quantity::name).collect()
}

impl Source {
    fn of(name: String, files: Vec<File>) -> Result<Self, HandError> {
        let file_count = files.len();
        let all = || files.iter().flat_map(|f| &f.recordings);
        let names_trials = all().any(|r| r.trial.is_some());
        let names_people = all().any(|r| r.person.is_some());
        let mut durations: Vec<f64> = all().map(Recording::duration_s).collect();
        durations.sort_by(f64::total_cmp);
        let short = durations[durations.len() / 2] <= LONGEST_TRIAL_S;
        let (cut, cut_words) = match (names_trials, file_count > 1 && short) {
            (true, _) => (
                ReachCut::ByTrial,
                "every trial from the onset of its movement to its contact or its last moving frame",
            ),
            (false, true) => (ReachCut::First, "the first reach of every file, by speed"),
            (false, false) => (ReachCut::All, "all reaches, by speed"),
        };
        let files_are_people = names_trials && !names_people && file_count > 1;
        let mut ignored_columns: Vec<String> = Vec::new();
        let mut met = HashSet::new();
        for column in all().flat_map(|r| r.ignored_columns.iter()) {
            if met.insert(column) {
                ignored_columns.push(column.clone());
            }
        }
        let points = quantities(&all().cloned().collect::<Vec<_>>()).join(", ");
        let mut recordings: Vec<Recording> = Vec::new();
        for file in files {
            let stem = file.path.file_stem();
            let stem = stem.map(|s| s.to_string_lossy().into_owned());
            for mut recording in file.recordings {
                if files_are_people {
                    recording.person.clone_from(&stem);
                }
                if cut == ReachCut::First {
                    recording.trial.clone_from(&stem);
                }
                recordings.push(recording);
            }
        }
        let config = LabelConfig {
            cut,
            ..LabelConfig::default()
        };
        let labelled = labelled_reaches(&recordings, &config)?;
        let mut reasons: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
        for left_out in &labelled.left_out {
            let entry = reasons.entry(left_out.why).or_insert((0, &left_out.what));
            entry.0 += 1;
        }
        let zero_rows: usize = recordings.iter().map(|recording| recording.zero_rows).sum();
        let zeros = format!("{zero_rows} × rows of zeros, taken as lost tracking");
        let left_out = reasons
            .iter()
            .map(|(why, (count, first))| format!("{count} × {why} (first: {first})"))
            .chain((zero_rows > 0).then_some(zeros))
            .collect();
        let touching = match labelled.reaches.first().map(|r| r.point) {
            None => "hand",
            Some(HandPoint::Palm) => "palm",
            Some(tip) => tip.name(),
        };
        let count = counted(file_count, "file", "files");
        Ok(Self {
            name,
            description: format!("{count}: {points}; {cut_words}; end of the {touching}"),
            reaches: labelled.reaches,
            recordings: labelled.recordings,
            left_out,
            ignored_columns,
        })
    }

    /// The cross-validation split.
    pub fn split(&self) -> Split {
        Split::of(&self.reaches, &self.recordings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_stage::input::recording_units::TimeUnit;
    use hwall_testkit::shared;

    #[test]
    fn of_many_unreadable_files_four_are_named() {
        let many: Vec<String> = (1..=6).map(|i| format!("{i}.csv: bad")).collect();
        let said = "1.csv: bad; 2.csv: bad; 3.csv: bad; 4.csv: bad; and 2 more";
        assert_eq!(reasons(&many), said);
    }

    #[test]
    fn no_two_studies_write_the_same_files() {
        let mut taken = BTreeSet::from(TAKEN.map(str::to_owned));
        let mut name = |path: &str| unused(path.to_owned(), &mut taken);
        let names = ["a/b", "a-b", "A-B", "a-b-2", "pointing"].map(&mut name);
        assert_eq!(names, ["a-b", "a-b-2", "A-B-3", "a-b-2-2", "pointing-2"]);
    }

    #[test]
    fn centimetres_and_milliseconds_are_the_same_reaches() {
        let folder = std::env::temp_dir().join(format!("hwall_units_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let ends = |scale: f64, per_s: f64, units: RecordingUnits| {
            let mut text = String::from("t,palm_x,palm_y,palm_z,trial\n0,0,0,0,1\n");
            for (trial, row) in (1..=2).flat_map(|trial| (1..=130).map(move |row| (trial, row))) {
                let share = (f64::from(row) / 100.0).min(1.0);
                let way_m = 0.4 * share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
                let t_s = f64::from(row) * 0.01;
                let [t, x, y, z] = [t_s * per_s, way_m * scale, 0.1 * scale, 1.1 * scale];
                text += &format!("{t},{x},{y},{z},{trial}\n");
            }
            let path = folder.join(format!("reaches-{scale}.csv"));
            std::fs::write(&path, text).unwrap();
            let found = read(Recorded { path: &path, units });
            found.map(|found| {
                let source = &found.sources[0];
                assert!(source.left_out.iter().any(|why| why.contains("zeros")));
                let ends = source.reaches.iter().map(|reach| reach.contact_m);
                ends.collect::<Vec<_>>()
            })
        };
        let metres = ends(1.0, 1.0, RecordingUnits::SI).unwrap();
        assert_eq!(metres.len(), 2);
        let units = RecordingUnits {
            hand_scale: 0.01,
            time_unit: TimeUnit::Ms,
        };
        for (a, b) in metres.iter().zip(ends(100.0, 1e3, units).unwrap()) {
            // Rounded times may end a reach one sample earlier.
            assert!(a.distance(b) < 1e-3, "{a} {b}");
        }
        let error = ends(100.0, 1e3, RecordingUnits::SI).unwrap_err();
        assert!(error.to_string().contains("--"), "{error}");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn recordings_beside_the_project_give_all_their_reaches() {
        if shared("data/kinesis_rtg").is_none() {
            return;
        }
        let dir = shared("data").unwrap();
        let FoundSources { sources, refused } = read(&dir).unwrap();
        // Memory-guided pointing with separate tables.
        let is_known = |name: &str| !name.starts_with("jov");
        assert!(refused.iter().all(|why| !is_known(why)), "{refused:?}");
        let known = sources.iter().filter(|source| is_known(&source.name));
        let counts = known.map(|source| {
            let (reaches, folds) = (source.reaches.len(), source.split().folds.len());
            format!("{} {reaches} {folds}", source.name)
        });
        let counts: Vec<String> = counts.collect();
        let expected = [
            "author_leap 6 6",
            "hand_embodiment 41 41",
            "kinesis_rtg 45 45",
        ];
        assert_eq!(counts, expected);
    }
}
