//! Folders of trajectories: one CSV file each, one row per sample, one column per degree of freedom.

use anyhow::{Context, bail, ensure};
use hwall_bip::Demonstration;
use hwall_stage::numbers::NumberReader;
use hwall_testkit::quantiles;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The column that holds time stamps, s. It is the first column, or missing.
const TIME: &str = "t";

/// Motions to train on, and motions to test on.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainTest {
    /// To train on.
    pub train: TrajectorySet,
    /// To test on.
    pub test: TrajectorySet,
}

/// Motions with the same columns.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectorySet {
    /// Names of the degrees of freedom.
    pub columns: Vec<String>,
    /// The motions, in the order of their files' names.
    pub trajectories: Vec<Trajectory>,
}

impl TrajectorySet {
    /// As training data; missing values are errors.
    ///
    /// # Errors
    /// A missing value, fewer than two samples.
    pub fn to_demonstrations(&self) -> anyhow::Result<Vec<Demonstration>> {
        let all = self.trajectories.iter();
        all.map(Trajectory::to_demonstration).collect()
    }
}

/// One motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Its origin, for messages.
    pub name: String,
    /// Number in the file's name if all files have different ones, else the index in the order.
    pub id: u64,
    /// Kind of motion, if the folder states it.
    pub kind: Option<String>,
    /// Strictly increasing time stamps, s; `None`: one sample per unit of time.
    pub times_s: Option<Vec<f64>>,
    /// Samples, never empty; `None` in them is a missing value.
    pub rows: Vec<Vec<Option<f64>>>,
}

/// Reads training and test motions, which must have the same columns. One folder may hold both.
///
/// # Errors
/// A folder or file that cannot be read, or whose content is not a table of numbers; the file, line
/// and column are named. A missing value in a training file.
pub fn read_both(train: &Path, test: &Path) -> anyhow::Result<TrainTest> {
    let same = match (train.canonicalize(), test.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    let both = same && !files_of(train, "train")?.is_empty() && !files_of(test, "test")?.is_empty();
    let [of_train, of_test] = match both {
        true => ["train", "test"],
        false => [""; 2],
    };
    let train = read(train, of_train)?;
    let mut test = read(test, of_test)?;
    for trajectory in &train.trajectories {
        trajectory.ensure_complete(&train.columns)?;
    }
    let (a, b) = (&train.trajectories[0], &test.trajectories[0]);
    same_columns((a, &train.columns), (b, &test.columns))?;
    test.trajectories.sort_by_key(|t| t.id);
    Ok(TrainTest { train, test })
}

/// Reads the motions of a folder from files with this prefix.
///
/// # Errors
/// As [`read_both`].
pub fn read(folder: &Path, prefix: &str) -> anyhow::Result<TrajectorySet> {
    let files = files_of(folder, prefix)?;
    ensure!(!files.is_empty(), "{}: no CSV files", folder.display());
    let kinds = kinds(folder)?;
    let numbers = numbers_in_names(&files);
    let mut set = TrajectorySet {
        columns: Vec::new(),
        trajectories: Vec::new(),
    };
    for (i, file) in files.iter().enumerate() {
        let id = numbers.as_ref().map_or(i as u64, |n| n[i]);
        let (columns, mut trajectory) = read_file(file, id)?;
        let name = file.file_name().unwrap_or_default();
        trajectory.kind = kinds.get(name.to_string_lossy().as_ref()).cloned();
        match set.trajectories.first() {
            None => set.columns = columns,
            Some(first) => same_columns((first, &set.columns), (&trajectory, &columns))?,
        }
        set.trajectories.push(trajectory);
    }
    Ok(set)
}

fn same_columns(
    (a, a_columns): (&Trajectory, &[String]),
    (b, b_columns): (&Trajectory, &[String]),
) -> anyhow::Result<()> {
    let (a_name, b_name) = (&a.name, &b.name);
    if a_columns.len() != b_columns.len() {
        let (n, m) = (a_columns.len(), b_columns.len());
        bail!("{a_name} has {n} degrees of freedom, {b_name} has {m}");
    }
    if let Some(i) = (0..a_columns.len()).find(|&i| a_columns[i] != b_columns[i]) {
        let (x, y) = (&a_columns[i], &b_columns[i]);
        bail!("degree of freedom {i} is column {x} in {a_name}, column {y} in {b_name}");
    }
    if a.times_s.is_some() != b.times_s.is_some() {
        bail!("of {a_name} and {b_name} only one has time stamps (first column {TIME})");
    }
    Ok(())
}

/// CSV files of a folder with this prefix.
fn files_of(folder: &Path, prefix: &str) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = csv_files(folder, false)?;
    files.retain(|path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().starts_with(prefix)
    });
    Ok(files)
}

/// CSV files of a folder, by name; `deep`: also those of the folders in it.
///
/// # Errors
/// A folder that cannot be read.
pub fn csv_files(folder: &Path, deep: bool) -> anyhow::Result<Vec<PathBuf>> {
    let context = || folder.display().to_string();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(context)? {
        let path = entry.with_context(context)?.path();
        if deep && path.is_dir() {
            files.extend(csv_files(&path, deep)?);
            continue;
        }
        let ending = path.extension().unwrap_or_default();
        if ending.eq_ignore_ascii_case("csv") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The last number in each name, if all have one and they differ.
fn numbers_in_names(files: &[PathBuf]) -> Option<Vec<u64>> {
    let number = |path: &PathBuf| -> Option<u64> {
        let stem = path.file_stem()?.to_str()?;
        let mut parts = stem.rsplit(|c: char| !c.is_ascii_digit());
        parts.find(|p| !p.is_empty())?.parse().ok()
    };
    let numbers: Vec<u64> = files.iter().map(number).collect::<Option<_>>()?;
    let mut sorted = numbers.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (sorted.len() == numbers.len()).then_some(numbers)
}

fn read_file(path: &Path, id: u64) -> anyhow::Result<(Vec<String>, Trajectory)> {
    let name = path.display().to_string();
    let mut reader = NumberReader::open(Some(path))?;
    let header = reader.header().to_vec();
    if let Some(i) = header.iter().position(String::is_empty) {
        bail!("{name} line 1: column {} has no name", i + 1);
    }
    let places = reader.columns(&header)?;
    let timed = header[0] == TIME;
    if let (false, Some(i)) = (timed, header.iter().position(|h| h == TIME)) {
        bail!("{name} line 1: {TIME} is column {}, not the first", i + 1);
    }
    let (times, dofs) = places.split_at(usize::from(timed));
    ensure!(
        !dofs.is_empty(),
        "{name} line 1: no column beside the time {TIME}"
    );
    let columns = dofs.iter().map(|&i| header[i].clone()).collect();
    let mut times_s: Vec<f64> = Vec::new();
    let mut rows = Vec::new();
    let mut before = None;
    while let Some(row) = reader.next_row()? {
        // Skipping a line would lose a sample and its time.
        let line = row.line();
        let follows = before.replace(line).is_none_or(|before| before + 1 == line);
        ensure!(follows, "{name} line {}: blank line", line - 1);
        if let [time] = reader.values(&row, times)?[..] {
            if let Some(&before) = times_s.last().filter(|before| **before >= time) {
                let place = reader.place(&row);
                bail!("{place}, column {TIME}: {time} s does not follow {before} s");
            }
            times_s.push(time);
        }
        rows.push(reader.values_or_missing(&row, dofs)?);
    }
    ensure!(!rows.is_empty(), "{name}: no samples below the header");
    let trajectory = Trajectory {
        name,
        id,
        kind: None,
        times_s: timed.then_some(times_s),
        rows,
    };
    Ok((columns, trajectory))
}

impl Trajectory {
    fn ensure_complete(&self, columns: &[String]) -> anyhow::Result<()> {
        for (row, values) in self.rows.iter().enumerate() {
            if let Some(d) = values.iter().position(Option::is_none) {
                // The header is line 1.
                let (line, column, name) = (row + 2, &columns[d], &self.name);
                bail!("{name} line {line}, column {column}: a training file has a missing value");
            }
        }
        Ok(())
    }

    /// As training data; missing values are errors.
    ///
    /// # Errors
    /// A missing value, fewer than two samples.
    pub fn to_demonstration(&self) -> anyhow::Result<Demonstration> {
        let dofs = self.rows[0].len();
        let values: Option<Vec<f64>> = self.rows.iter().flatten().copied().collect();
        let values = values.with_context(|| format!("{}: missing values", self.name))?;
        let demonstration = match &self.times_s {
            Some(times) => Demonstration::from_timestamps(times.clone(), dofs, values),
            None => Demonstration::from_samples(1.0, dofs, values),
        };
        demonstration.with_context(|| self.name.clone())
    }

    /// Time step before each sample; before the first one the median of the others.
    ///
    /// `period`: the step of a motion with one sample.
    pub fn steps(&self, period: f64) -> Vec<f64> {
        let Some(times_s) = &self.times_s else {
            return vec![1.0; self.rows.len()];
        };
        let steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        let first = match steps.is_empty() {
            true => period,
            false => quantiles(steps.iter().copied(), [0.5])[0],
        };
        [first].into_iter().chain(steps).collect()
    }
}

/// Kinds of motion by the names of files, from `workload_meta.json`, if there is one: entries with `file` and `kind`.
fn kinds(folder: &Path) -> anyhow::Result<BTreeMap<String, String>> {
    let path = folder.join("workload_meta.json");
    if !path.exists() {
        return Ok(BTreeMap::new());
    }
    let context = || path.display().to_string();
    let text = std::fs::read_to_string(&path).with_context(context)?;
    let meta: serde_json::Value = serde_json::from_str(&text).with_context(context)?;
    let entry = |e: &serde_json::Value| {
        let (file, kind) = (e["file"].as_str()?, e["kind"].as_str()?);
        let file = Path::new(file).file_name()?.to_str()?;
        Some((file.to_owned(), kind.to_owned()))
    };
    let tests = meta["test"].as_array().into_iter().flatten();
    // The first entry of a file takes precedence.
    Ok(tests.rev().filter_map(entry).collect())
}
