//! Reading a study from a wide table: one row per subject, one column per combination of levels.

use super::complete::Study;
use super::table::{Columns, Trial, answer_of, assemble, find};
use crate::error::{PsychophysicsError, Result};
use hwall_files::{Row, Table};

/// A column of answers: its index, and the level of every factor.
struct AnswerColumn {
    place: usize,
    levels: Vec<String>,
}

impl Study {
    /// Reads a wide table: a header line, then one row per subject. Names of answer columns are the levels of the factors of
    /// `columns` in order, joined by `joint`: `0_20`, `0_40`, `45_20` for the factors angle and speed and the joint `_`. With
    /// a single factor, the answer columns are those named by the factor and a level (`angle_0`, `angle_45`); if there are
    /// none, those with numbers as names; if there are none either, all. Other columns are ignored; [`Study::wide_columns`]
    /// lists the columns used. [`Columns::value`] only names the answers.
    ///
    /// # Errors
    /// As [`Study::from_csv_str`], with the lines and columns of this table; no column of answers; rounds, which wide tables
    /// do not have.
    pub fn from_wide_csv_str(
        text: impl AsRef<[u8]>,
        columns: &Columns,
        joint: &str,
    ) -> Result<Self> {
        let mut table = Table::new(text.as_ref())?;
        let header = table.header().to_vec();
        let answers = answer_columns(&header, columns, joint)?;
        let subject_at = find(&header, &columns.subject)?;
        let between_at = columns.between.as_ref().map(|name| find(&header, name));
        let between_at = between_at.transpose()?;
        let mut trials = Vec::new();
        let mut row = Row::default();
        while table.next_row(&mut row)? {
            let line = row.line();
            let key = |place: usize| {
                let text = Some(row.cell(place)).filter(|text| !text.is_empty());
                text.map(str::to_owned)
                    .ok_or_else(|| PsychophysicsError::EmptyCell {
                        line,
                        column: header.get(place).cloned().unwrap_or_default(),
                    })
            };
            let (subject, group) = (key(subject_at)?, between_at.map(key).transpose()?);
            for column in &answers {
                let value = answer_of(&row, column.place, &header, columns.missing)?;
                trials.push(Trial {
                    line,
                    subject: subject.clone(),
                    group: group.clone().unwrap_or_default(),
                    levels: column.levels.clone(),
                    round: Vec::new(),
                    value,
                });
            }
        }
        if trials.is_empty() {
            return Err(PsychophysicsError::NoRows);
        }
        assemble(trials, columns)
    }

    /// The columns of a wide table that [`Study::from_wide_csv_str`] reads as answers.
    ///
    /// # Errors
    /// A header that [`Study::from_wide_csv_str`] refuses.
    pub fn wide_columns(
        text: impl AsRef<[u8]>,
        columns: &Columns,
        joint: &str,
    ) -> Result<Vec<String>> {
        let header = Table::new(text.as_ref())?.header().to_vec();
        let taken = answer_columns(&header, columns, joint)?;
        Ok(taken
            .into_iter()
            .filter_map(|column| header.get(column.place).cloned())
            .collect())
    }
}

fn answer_columns(header: &[String], columns: &Columns, joint: &str) -> Result<Vec<AnswerColumn>> {
    let refused = |why: &'static str| PsychophysicsError::Wide { why };
    if !columns.rounds.is_empty() {
        return Err(refused("it has no rounds"));
    }
    if columns.valid.is_some() {
        return Err(refused("it has no column that says which trials count"));
    }
    if joint.is_empty() && columns.within.len() > 1 {
        return Err(refused("levels need a text that joins them"));
    }
    let named = [Some(&columns.subject), columns.between.as_ref()];
    let is_named = |name: &str| named.iter().flatten().any(|n| n.eq_ignore_ascii_case(name));
    let others = header.iter().enumerate();
    let others: Vec<(usize, &str)> = others
        .map(|(place, name)| (place, name.as_str()))
        .filter(|(_, name)| !name.is_empty() && !is_named(name))
        .collect();
    let taken: Vec<AnswerColumn> = match &columns.within[..] {
        [factor] => of_one_factor(&others, factor, joint),
        several => others
            .iter()
            .filter_map(|(place, name)| {
                let levels: Vec<String> = name.split(joint).map(str::to_owned).collect();
                let fits = levels.len() == several.len() && levels.iter().all(|l| !l.is_empty());
                let place = *place;
                fits.then_some(AnswerColumn { place, levels })
            })
            .collect(),
    };
    if taken.is_empty() {
        return Err(refused("no column is named by a level of every factor"));
    }
    for (i, column) in taken.iter().enumerate() {
        if taken[..i].iter().any(|other| other.levels == column.levels) {
            let column = header.get(column.place).cloned().unwrap_or_default();
            return Err(PsychophysicsError::ColumnTwice { column });
        }
    }
    Ok(taken)
}

/// Columns named by the factor and a level; if there are none, those whose names are numbers; if there are none either, all.
fn of_one_factor(others: &[(usize, &str)], factor: &str, joint: &str) -> Vec<AnswerColumn> {
    let take = |level_of: &dyn Fn(&str) -> Option<String>| -> Vec<AnswerColumn> {
        let found = others.iter().filter_map(|(place, name)| {
            let levels = vec![level_of(name)?];
            let place = *place;
            Some(AnswerColumn { place, levels })
        });
        found.collect()
    };
    let named = take(&|name| {
        let level = name.strip_prefix(factor)?.strip_prefix(joint)?;
        (!level.is_empty()).then(|| level.to_owned())
    });
    if !named.is_empty() {
        return named;
    }
    let numbers = take(&|name| {
        let number = name.parse::<f64>().ok().filter(|v| v.is_finite());
        number.map(|_| name.to_owned())
    });
    if !numbers.is_empty() {
        return numbers;
    }
    take(&|name| Some(name.to_owned()))
}
