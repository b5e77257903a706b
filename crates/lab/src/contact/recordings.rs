//! Labelled reaches from recorded hands, and who is held out when.

use anyhow::{Context, ensure};
use hwall_hand::{
    HandError, HandPoint, LabelConfig, LabelledReach, Quantity, ReachCut, Recording,
    labelled_reaches, read_recordings,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Files of a folder that last this long at most, s, and name no trials are one trial each.
const LONGEST_TRIAL_S: f64 = 10.0;
/// From so many recordings on, whole recordings are held out.
const FEWEST_RECORDINGS: usize = 5;
/// What the simulated protocols call their files: recordings beside them are named otherwise.
const TAKEN: [&str; 4] = ["dissertation", "open-hand", "pointing", "rooms"];
/// Reasons that an error lists.
const MOST_REASONS: usize = 4;
/// More folds than this are joined: training is repeated for each.
const MOST_FOLDS: usize = 50;

/// Reaches of one study, all with the same points of the hand, in the frame of its tracker.
#[derive(Debug, Clone)]
pub struct Source {
    /// The folder or the file, for tables and names of figures.
    pub name: String,
    /// What was recorded and how it was cut.
    pub description: String,
    /// The reaches.
    pub reaches: Vec<LabelledReach>,
    /// The recording that each reach is from.
    pub recordings: Vec<usize>,
    /// What was left out: how often, the reason, and the first of them.
    pub left_out: Vec<String>,
    /// Columns that mean nothing here, in the order in which they were met.
    pub ignored_columns: Vec<String>,
}

/// What is learnt from and what is judged, by number of the reach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fold {
    /// Learnt from.
    pub train: Vec<usize>,
    /// Judged.
    pub test: Vec<usize>,
}

/// How the reaches are divided.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// In words.
    pub description: String,
    /// Every reach is judged in one fold at most.
    pub folds: Vec<Fold>,
}

/// One file, and what is in it.
struct File {
    path: PathBuf,
    recordings: Vec<Recording>,
}

/// The study in a file, or all under a folder, and a line for each file there that is no recording of a
/// hand. No two studies have the same name.
///
/// Files of one folder with the same quantities belong together. Where no person is named but
/// trials are, in several files, each file is a person. Where neither is, and half of the several files last
/// no longer than ten seconds, each file is one trial of which the first reach counts: what follows is the
/// way back. Everything else without trials is cut by speed into all of its reaches.
///
/// A folder below this one in which all files are named `train-*.csv` and `test-*.csv` holds motions for
/// `bip_filter`, as made beside recordings by `--generate`: the same hands once more, so it is passed over.
///
/// # Errors
/// Nothing there, or no recording of a hand in it.
pub fn read(path: &Path) -> anyhow::Result<(Vec<Source>, Vec<String>)> {
    ensure!(path.exists(), "{}: no such file or folder", path.display());
    let (mut groups, mut refused) = (BTreeMap::<_, Vec<File>>::new(), Vec::new());
    let mut files = Vec::new();
    let dir = if path.is_dir() {
        csv_files(path, &mut files)?;
        files.sort();
        for (folder, count) in pass_over_motions(path, &mut files) {
            refused.push(format!(
                "{}: {count} motions for bip_filter (train-*.csv, test-*.csv), no recordings",
                folder.strip_prefix(path).unwrap_or(&folder).display()
            ));
        }
        path
    } else {
        files.push(path.to_owned());
        path.parent().unwrap_or(path)
    };
    for path in files {
        let name = path.strip_prefix(dir).unwrap_or(&path).to_owned();
        match std::fs::File::open(&path)
            .map_err(anyhow::Error::new)
            .and_then(|f| read_recordings(f).map_err(anyhow::Error::new))
        {
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
    let several: BTreeSet<PathBuf> = {
        let folders: Vec<&PathBuf> = groups.keys().map(|(folder, _)| folder).collect();
        let twice = folders.windows(2).filter(|w| w[0] == w[1]);
        twice.map(|w| w[0].clone()).collect()
    };
    let mut sources = Vec::new();
    let mut taken = BTreeSet::from(TAKEN.map(str::to_owned));
    for ((folder, _), files) in groups {
        let name = if folder.as_os_str().is_empty() || several.contains(&folder) {
            files[0].path.with_extension("")
        } else {
            folder
        };
        let name = unused(name.display().to_string(), &mut taken);
        let source = Source::of(name.clone(), files).with_context(|| name)?;
        sources.push(source);
    }
    Ok((sources, refused))
}

/// A name for files that no other study has, whatever the case of its letters: the path with dashes, and
/// a number where that is `taken`.
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

/// Why nothing could be read, in one line.
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

/// Takes the files of folders of motions out, and says which folders and how many files.
fn pass_over_motions(dir: &Path, files: &mut Vec<PathBuf>) -> Vec<(PathBuf, usize)> {
    let of_motion = |path: &Path| {
        let stem = path.file_stem().map(|s| s.to_string_lossy());
        stem.is_some_and(|s| s.starts_with("train-") || s.starts_with("test-"))
    };
    let mut folders = BTreeMap::<PathBuf, (bool, usize)>::new();
    for path in files.iter() {
        let folder = path.parent().unwrap_or(dir).to_owned();
        // A folder that is named by the user is meant.
        let (motions, count) = folders.entry(folder.clone()).or_insert((folder != dir, 0));
        *motions &= of_motion(path);
        *count += 1;
    }
    folders.retain(|_, (motions, _)| *motions);
    files.retain(|path| {
        path.parent()
            .is_none_or(|folder| !folders.contains_key(folder))
    });
    let counts = folders.into_iter();
    counts.map(|(folder, (_, count))| (folder, count)).collect()
}

fn csv_files(dir: &Path, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(dir).with_context(|| dir.display().to_string())? {
        let path = entry.with_context(|| dir.display().to_string())?.path();
        if path.is_dir() {
            csv_files(&path, found)?;
        } else if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("csv"))
        {
            found.push(path);
        }
    }
    Ok(())
}

/// Names of what is seen at least once.
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
        let (cut, cut_words) = if names_trials {
            let words = "every trial from the onset of its movement to its contact or its last moving frame";
            (ReachCut::ByTrial, words)
        } else if file_count > 1 && short {
            let words = "the first reach of every file, by speed";
            (ReachCut::First, words)
        } else {
            (ReachCut::All, "all reaches, by speed")
        };
        let files_are_people = names_trials && !names_people && file_count > 1;
        let mut ignored_columns: Vec<String> = Vec::new();
        for column in all().flat_map(|r| &r.ignored_columns) {
            if !ignored_columns.contains(column) {
                ignored_columns.push(column.clone());
            }
        }
        let points = quantities(&all().cloned().collect::<Vec<_>>()).join(", ");
        let recordings: Vec<Recording> = files
            .into_iter()
            .flat_map(|file| {
                let stem = file
                    .path
                    .file_stem()
                    .map(|s| s.to_string_lossy().into_owned());
                file.recordings.into_iter().map(move |mut recording| {
                    if files_are_people {
                        recording.person.clone_from(&stem);
                    }
                    if cut == ReachCut::First {
                        recording.trial.clone_from(&stem);
                    }
                    recording
                })
            })
            .collect();
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
        let left_out = reasons
            .iter()
            .map(|(why, (count, first))| format!("{count} × {why} (first: {first})"))
            .collect();
        let touching = labelled.reaches.first().map(|r| r.point);
        Ok(Self {
            name,
            description: format!(
                "{file_count} {}: {points}; {cut_words}; end of the {}",
                if file_count == 1 { "file" } else { "files" },
                touching.map_or("hand", |p| match p {
                    HandPoint::Palm => "palm",
                    tip => tip.name(),
                })
            ),
            reaches: labelled.reaches,
            recordings: labelled.recordings,
            left_out,
            ignored_columns,
        })
    }

    /// Who is held out when.
    #[must_use]
    pub fn split(&self) -> Split {
        Split::of(&self.reaches, &self.recordings)
    }
}

impl Split {
    /// Who is held out when: each person, of two and more; else each recording, of five and more; else each
    /// reach. More than fifty folds are joined, neighbours first.
    #[must_use]
    pub fn of(reaches: &[LabelledReach], recordings: &[usize]) -> Self {
        let people: Option<Vec<&str>> = reaches.iter().map(|r| r.person.as_deref()).collect();
        let people = people.map(|p| units(&p));
        let recordings = units(recordings);
        let count = |units: &[usize]| units.iter().max().map_or(0, |m| m + 1);
        let (what, units) = match people {
            Some(people) if count(&people) >= 2 => ("person", people),
            _ if count(&recordings) >= FEWEST_RECORDINGS => ("recording", recordings),
            _ => ("reach", (0..reaches.len()).collect()),
        };
        let n = count(&units);
        let folds = n.min(MOST_FOLDS);
        let fold_of = |unit: usize| unit * folds / n;
        let description = if folds == n {
            format!("each {what} held out: {n} folds")
        } else {
            format!("{n} units ({what}), neighbours held out together: {folds} folds")
        };
        let part = |fold: usize, held_out: bool| {
            let belongs = |i: &usize| (fold_of(units[*i]) == fold) == held_out;
            (0..units.len()).filter(belongs).collect()
        };
        Self {
            description,
            folds: (0..folds)
                .map(|fold| Fold {
                    train: part(fold, false),
                    test: part(fold, true),
                })
                .collect(),
        }
    }
}

/// Numbers equal things alike, in the order of their first.
fn units<T: PartialEq>(things: &[T]) -> Vec<usize> {
    let mut known: Vec<&T> = Vec::new();
    things
        .iter()
        .map(|thing| {
            known.iter().position(|k| *k == thing).unwrap_or_else(|| {
                known.push(thing);
                known.len() - 1
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_hand::HandFrame;

    fn reach(person: Option<&str>) -> LabelledReach {
        LabelledReach {
            person: person.map(str::to_owned),
            trial: None,
            point: HandPoint::Index,
            frames: vec![HandFrame::empty(0.0)],
            contact_m: DVec3::ZERO,
            contact_s: 1.0,
            normal: None,
        }
    }

    #[test]
    fn people_are_held_out_else_recordings_else_reaches() {
        let of = |people: &[Option<&str>], recordings: &[usize]| {
            let reaches: Vec<LabelledReach> = people.iter().map(|p| reach(*p)).collect();
            let split = Split::of(&reaches, recordings);
            // Everything is judged once, and by nothing that it taught.
            let mut judged: Vec<usize> = split.folds.iter().flat_map(|f| f.test.clone()).collect();
            judged.sort_unstable();
            assert_eq!(judged, (0..reaches.len()).collect::<Vec<_>>());
            for fold in &split.folds {
                assert!(fold.train.iter().all(|i| !fold.test.contains(i)));
                assert_eq!(fold.train.len() + fold.test.len(), reaches.len());
            }
            split
        };
        let (a, b) = (Some("a"), Some("b"));
        let people = of(&[a, b, a, b, b], &[0, 1, 2, 3, 4]);
        assert_eq!(people.folds[0].test, [0, 2]);
        assert!(
            people.description.contains("each person"),
            "{}",
            people.description
        );
        // One person, or some that nobody names: recordings.
        for names in [[a; 6], [a, b, None, a, b, a]] {
            let recordings = of(&names, &[0, 0, 1, 2, 3, 4]);
            assert!(recordings.description.contains("each recording"));
            assert_eq!(recordings.folds[0].test, [0, 1]);
        }
        assert_eq!(of(&[None; 4], &[0, 0, 1, 1]).folds.len(), 4);
        // Neighbours go together.
        let many = of(&[None; 120], &[0; 120]);
        assert_eq!(many.folds.len(), MOST_FOLDS);
        assert_eq!(many.folds[0].test, [0, 1, 2]);
    }

    #[test]
    fn no_folder_and_no_recording_are_one_clear_line() {
        let error = read(Path::new("nowhere")).unwrap_err();
        assert_eq!(error.to_string(), "nowhere: no such file or folder");
        let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let error = read(&here).unwrap_err().to_string();
        let expected = format!("no readable recording in {}: no CSV file", here.display());
        assert_eq!(error, expected);
        let many: Vec<String> = (1..=6).map(|i| format!("{i}.csv: bad")).collect();
        assert_eq!(
            reasons(&many),
            "1.csv: bad; 2.csv: bad; 3.csv: bad; 4.csv: bad; and 2 more"
        );
    }

    #[test]
    fn no_two_studies_write_the_same_files() {
        let mut taken = BTreeSet::from(TAKEN.map(str::to_owned));
        let mut name = |path: &str| unused(path.to_owned(), &mut taken);
        let names = ["a/b", "a-b", "A-B", "a-b-2", "rooms"].map(&mut name);
        assert_eq!(names, ["a-b", "a-b-2", "A-B-3", "a-b-2-2", "rooms-2"]);
    }

    #[test]
    fn recordings_beside_the_project_give_all_their_reaches() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
        if !dir.join("kinesis_rtg").is_dir() {
            println!("skipped: recordings are not beside the project");
            return;
        }
        let (sources, refused) = read(&dir).unwrap();
        assert_eq!(refused, Vec::<String>::new());
        let counts: Vec<(&str, usize, usize)> = sources
            .iter()
            .map(|s| (s.name.as_str(), s.reaches.len(), s.split().folds.len()))
            .collect();
        let expected = [
            ("author_leap", 6, 6),
            ("hand_embodiment", 41, 41),
            ("kinesis_rtg", 45, 45),
        ];
        assert_eq!(counts, expected);
    }
}
