//! Reading a study from a long table: one row per trial, columns by name.

use super::complete::{MOST_SIZE, Study, TrialAnswer};
use super::factor::{Factor, Groups};
use super::missing::{LeftOut, Missing};
use crate::error::{PsychophysicsError, Result};
use hwall_files::{Row, Table};
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

/// Roles of the columns of a long table.
///
/// A name is looked up as written, then regardless of case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Subject.
    pub subject: String,
    /// Factors that vary within subjects, slowest first.
    pub within: Vec<String>,
    /// Factor that varies between subjects only.
    pub between: Option<String>,
    /// Columns that number repeated trials, which are averaged.
    pub rounds: Vec<String>,
    /// The answer.
    pub value: String,
    /// Handling of missing answers: no row, an empty cell, `NaN`, `NA` or `N/A`.
    pub missing: Missing,
    /// Column that marks rows as valid (`true`, `yes`, `1`) or not (`false`, `no`, `0`). Long tables only.
    pub valid: Option<String>,
}

impl Columns {
    /// Columns of subjects, factors within subjects and answers, without groups and rounds.
    pub fn new<F: Into<String>>(
        subject: impl Into<String>,
        within: impl IntoIterator<Item = F>,
        value: impl Into<String>,
    ) -> Self {
        Self {
            subject: subject.into(),
            within: within.into_iter().map(Into::into).collect(),
            between: None,
            rounds: Vec::new(),
            value: value.into(),
            missing: Missing::default(),
            valid: None,
        }
    }

    /// Leaves out rows that this column marks as invalid; [`Study::invalid_rows`] counts them.
    #[must_use]
    pub fn with_valid(mut self, column: impl Into<String>) -> Self {
        self.valid = Some(column.into());
        self
    }

    /// Leaves out subjects with a missing answer.
    #[must_use]
    pub const fn complete_cases(mut self) -> Self {
        self.missing = Missing::CompleteCases;
        self
    }

    /// Adds a factor between subjects.
    #[must_use]
    pub fn with_between(mut self, factor: impl Into<String>) -> Self {
        self.between = Some(factor.into());
        self
    }

    /// Adds a column of rounds.
    #[must_use]
    pub fn with_round(mut self, column: impl Into<String>) -> Self {
        self.rounds.push(column.into());
        self
    }
}

/// Cells of one row, by role.
pub(super) struct Trial {
    pub(super) line: u64,
    pub(super) subject: String,
    pub(super) group: String,
    pub(super) levels: Vec<String>,
    pub(super) round: Vec<String>,
    /// `None` for a missing answer where allowed.
    pub(super) value: Option<f64>,
}

impl Study {
    /// Reads a long table from CSV text: a header line, then one row per trial.
    ///
    /// For the format of the text see [`Table`]. Trials that differ only in their round are averaged (arithmetic mean).
    ///
    /// # Errors
    /// Missing, double or empty cells and cells that are not numbers, with line and column.
    pub fn from_csv_str(text: &str, columns: &Columns) -> Result<Self> {
        Self::read_csv(text.as_bytes(), columns)
    }

    /// Reads a file as [`Study::from_csv_str`] reads text.
    ///
    /// # Errors
    /// As [`Study::from_csv_str`], and a file that cannot be read.
    pub fn from_csv_path(path: impl AsRef<Path>, columns: &Columns) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path);
        let bytes =
            bytes.map_err(|error| PsychophysicsError::io(path.display().to_string(), &error))?;
        Self::read_csv(bytes.as_slice(), columns)
    }

    /// Reads a stream as [`Study::from_csv_str`] reads text.
    ///
    /// # Errors
    /// As [`Study::from_csv_str`], and a stream that cannot be read.
    pub fn read_csv(mut source: impl Read, columns: &Columns) -> Result<Self> {
        let mut bytes = Vec::new();
        source
            .read_to_end(&mut bytes)
            .map_err(|error| PsychophysicsError::io("table", &error))?;
        let (trials, invalid_rows) = read_trials(&bytes, columns)?;
        Ok(Self {
            invalid_rows,
            ..assemble(trials, columns)?
        })
    }
}

/// The valid rows, and the number of invalid ones.
fn read_trials(bytes: &[u8], columns: &Columns) -> Result<(Vec<Trial>, usize)> {
    let mut table = Table::new(bytes)?;
    let header = table.header().to_vec();
    let mut taken = vec![false; header.len()];
    let mut take = |column: &String| {
        let place = find(&header, column)?;
        if std::mem::replace(&mut taken[place], true) {
            let column = column.clone();
            return Err(PsychophysicsError::ColumnTwice { column });
        }
        Ok(place)
    };
    let subject_at = take(&columns.subject)?;
    let within_at = columns.within.iter().map(&mut take);
    let within_at: Vec<usize> = within_at.collect::<Result<_, _>>()?;
    let between_at = columns.between.as_ref().map(&mut take).transpose()?;
    let rounds_at = columns.rounds.iter().map(&mut take);
    let rounds_at: Vec<usize> = rounds_at.collect::<Result<_, _>>()?;
    let value_at = take(&columns.value)?;
    let valid_at = columns.valid.as_ref().map(&mut take).transpose()?;
    let (mut trials, mut invalid_rows) = (Vec::new(), 0);
    let mut row = Row::default();
    while table.next_row(&mut row)? {
        let line = row.line();
        if let Some(place) = valid_at
            && !counts(row.cell(place), (line, header[place].as_str()))?
        {
            invalid_rows += 1;
            continue;
        }
        let key = |&place: &usize| {
            if row.cell(place).is_empty() {
                let column = header[place].clone();
                return Err(PsychophysicsError::EmptyCell { line, column });
            }
            Ok(row.cell(place).to_owned())
        };
        let subject = key(&subject_at)?;
        let levels = within_at.iter().map(key).collect::<Result<_, _>>()?;
        let group = between_at.as_ref().map(key).transpose()?;
        let round = rounds_at.iter().map(key).collect::<Result<_, _>>()?;
        let value = answer_of(&row, value_at, &header, columns.missing)?;
        trials.push(Trial {
            line,
            subject,
            group: group.unwrap_or_default(),
            levels,
            round,
            value,
        });
    }
    match trials.len() {
        0 if invalid_rows > 0 => Err(PsychophysicsError::NoValidRows { rows: invalid_rows }),
        0 => Err(PsychophysicsError::NoRows),
        _ => Ok((trials, invalid_rows)),
    }
}

/// Is the row valid? The line and column are for the error.
fn counts(text: &str, (line, column): (u64, &str)) -> Result<bool> {
    let is = |words: [&str; 3]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    if is(["true", "yes", "1"]) {
        return Ok(true);
    }
    if is(["false", "no", "0"]) {
        return Ok(false);
    }
    Err(PsychophysicsError::NeitherValidNorNot {
        line,
        column: column.to_owned(),
        text: text.chars().take(40).collect(),
    })
}

/// The number in an answer cell; `None` if it is missing and that is allowed.
pub(super) fn answer_of(
    row: &Row,
    place: usize,
    header: &[String],
    missing: Missing,
) -> Result<Option<f64>> {
    let line = row.line();
    let value = match row.number(place) {
        Ok(None) if missing == Missing::CompleteCases => return Ok(None),
        Ok(Some(value)) => value,
        _ => {
            return Err(PsychophysicsError::NotANumber {
                line,
                column: header.get(place).cloned().unwrap_or_default(),
                text: row.cell(place).chars().take(40).collect(),
            });
        }
    };
    // Checked here, because the mean over rounds belongs to no single line of the table.
    if value.abs() > MOST_SIZE {
        return Err(PsychophysicsError::Scale { line, value });
    }
    Ok(Some(value))
}

pub(super) fn find(header: &[String], column: &str) -> Result<usize> {
    let places = |same: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..header.len()).filter(|&i| same(&header[i])).collect()
    };
    let mut found = places(&|h| h == column);
    if found.is_empty() {
        let lower = column.trim().to_lowercase();
        found = places(&|h| h.to_lowercase() == lower);
    }
    match found.as_slice() {
        [place] => Ok(*place),
        [] => Err(PsychophysicsError::UnknownColumn {
            column: column.to_owned(),
            header: header.join(",").chars().take(400).collect(),
        }),
        several => Err(PsychophysicsError::AmbiguousColumn {
            column: column.to_owned(),
            count: several.len(),
        }),
    }
}

/// Levels of a column in order, and the index of each text among them.
struct Levels {
    names: Vec<String>,
    place: HashMap<String, usize>,
}

impl Levels {
    /// In order of size if all are numbers (`0` and `0.0` are then the same level), otherwise in order of appearance.
    fn ordered<'a>(texts: impl Iterator<Item = &'a String>) -> Self {
        let appeared = Self::appeared(texts);
        let number = |l: &String| l.parse().ok().filter(|v: &f64| v.is_finite());
        let numbers: Option<Vec<f64>> = appeared.names.iter().map(number).collect();
        let Some(numbers) = numbers else {
            return appeared;
        };
        let mut order: Vec<usize> = (0..numbers.len()).collect();
        order.sort_by(|&a, &b| numbers[a].total_cmp(&numbers[b]));
        let mut names: Vec<String> = Vec::new();
        let mut place = HashMap::new();
        let mut last = None;
        for i in order {
            if last != Some(numbers[i]) {
                names.push(appeared.names[i].clone());
            }
            last = Some(numbers[i]);
            place.insert(appeared.names[i].clone(), names.len() - 1);
        }
        Self { names, place }
    }

    /// In order of first appearance.
    fn appeared<'a>(texts: impl Iterator<Item = &'a String>) -> Self {
        let mut names: Vec<String> = Vec::new();
        let mut place = HashMap::new();
        for text in texts {
            if !place.contains_key(text) {
                place.insert(text.clone(), names.len());
                names.push(text.clone());
            }
        }
        Self { names, place }
    }

    fn len(&self) -> usize {
        self.names.len()
    }
}

pub(super) fn assemble(trials: Vec<Trial>, columns: &Columns) -> Result<Study> {
    let subjects = Levels::appeared(trials.iter().map(|t| &t.subject));
    let level = |f: usize| Levels::ordered(trials.iter().map(move |t| &t.levels[f]));
    let levels: Vec<Levels> = (0..columns.within.len()).map(level).collect();
    let round = |r: usize| Levels::ordered(trials.iter().map(move |t| &t.round[r]));
    let rounds: Vec<Levels> = (0..columns.rounds.len()).map(round).collect();
    let between = columns.between.as_ref();
    let between = between.map(|name| groups(name, &trials, &subjects));
    let between = between.transpose()?;

    // Every answer has a slot: subject, then factors, then rounds. A factor with many different values could need more
    // slots than memory allows, so only occupied slots are stored.
    let axes: Vec<&Levels> = levels.iter().chain(&rounds).collect();
    let names: Vec<&String> = columns.within.iter().chain(&columns.rounds).collect();
    let slots = axes.iter().map(|a| a.len() as u128);
    let each = slots.fold(1_u128, u128::saturating_mul);
    let mut taken: HashMap<u128, TrialAnswer> = HashMap::with_capacity(trials.len());
    let mut there = vec![0_u128; subjects.len()];
    for trial in &trials {
        let keys = trial.levels.iter().chain(&trial.round);
        let mut slot = subjects.place[&trial.subject] as u128;
        for (axis, key) in axes.iter().zip(keys) {
            slot = slot.saturating_mul(axis.len() as u128);
            slot = slot.saturating_add(axis.place[key] as u128);
        }
        let Some(value) = trial.value else {
            continue;
        };
        there[subjects.place[&trial.subject]] += 1;
        let answer = TrialAnswer {
            value,
            line: trial.line,
        };
        if let Some(first) = taken.insert(slot, answer) {
            return Err(PsychophysicsError::Duplicate {
                line: trial.line,
                first_line: first.line,
                subject: trial.subject.clone(),
                cell: words(&names, &axes, slot % each),
                rounds: !rounds.is_empty(),
            });
        }
    }
    let (mut left_out, mut complete) = (Vec::new(), Vec::new());
    for (subject, name) in subjects.names.iter().enumerate() {
        let first_slot = each.saturating_mul(subject as u128);
        let mut own = first_slot..first_slot.saturating_add(each);
        let Some(first) = own.find(|slot| !taken.contains_key(slot)) else {
            complete.push(subject);
            continue;
        };
        left_out.push(LeftOut {
            subject: name.clone(),
            cell: words(&names, &axes, first - first_slot),
            missing: each
                .saturating_sub(there[subject])
                .try_into()
                .unwrap_or(usize::MAX),
        });
    }
    if let Some(first) = left_out.first()
        && (columns.missing == Missing::Refuse || complete.is_empty())
    {
        let missing = left_out.iter().map(|l| l.missing);
        return Err(PsychophysicsError::MissingCell {
            subject: first.subject.clone(),
            cell: first.cell.clone(),
            missing: missing.fold(0, usize::saturating_add),
        });
    }
    let kept = complete.iter().map(|subject| each * *subject as u128);
    let slots = kept.flat_map(|first| first..first + each);
    let slots: Vec<TrialAnswer> = slots.map(|slot| taken[&slot]).collect();
    let between = between.map(|groups| Groups {
        of_subject: complete.iter().map(|s| groups.of_subject[*s]).collect(),
        ..groups
    });
    let per_cell: usize = rounds.iter().map(Levels::len).product();
    let cells = slots.chunks_exact(per_cell);
    let (values, least) = cells
        .map(|trials| {
            let sum: f64 = trials.iter().map(|t| t.value).sum();
            let mut least = TrialAnswer {
                value: f64::INFINITY,
                line: 0,
            };
            for &trial in trials {
                if trial.value < least.value {
                    least = trial;
                }
            }
            (sum / per_cell as f64, least)
        })
        .unzip();
    let factor = |(name, levels): (&String, Levels)| Factor::new(name, levels.names);
    Study {
        subjects: complete
            .iter()
            .map(|s| subjects.names[*s].clone())
            .collect(),
        within: columns.within.iter().zip(levels).map(factor).collect(),
        between,
        values,
        rounds: per_cell,
        least,
        value_name: columns.value.clone(),
        left_out,
        invalid_rows: 0,
    }
    .checked()
}

fn words(names: &[&String], axes: &[&Levels], mut index: u128) -> String {
    let mut words = Vec::new();
    for (name, axis) in names.iter().zip(axes).rev() {
        let count = axis.len() as u128;
        words.push(format!("{name}={}", axis.names[(index % count) as usize]));
        index /= count;
    }
    words.reverse();
    words.join(", ")
}

fn groups(name: &str, trials: &[Trial], subjects: &Levels) -> Result<Groups> {
    let levels = Levels::ordered(trials.iter().map(|t| &t.group));
    let mut seen: Vec<Option<(usize, u64)>> = vec![None; subjects.len()];
    for trial in trials {
        let group = levels.place[&trial.group];
        match &mut seen[subjects.place[&trial.subject]] {
            Some((first, first_line)) if *first != group => {
                return Err(PsychophysicsError::SubjectInTwoGroups {
                    line: trial.line,
                    first_line: *first_line,
                    subject: trial.subject.clone(),
                    factor: name.to_owned(),
                    group: trial.group.clone(),
                });
            }
            Some(_) => {}
            empty => *empty = Some((group, trial.line)),
        }
    }
    Ok(Groups {
        factor: Factor::new(name, levels.names),
        of_subject: seen.into_iter().flatten().map(|(g, _)| g).collect(),
    })
}
