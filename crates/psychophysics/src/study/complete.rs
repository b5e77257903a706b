//! A complete study: one value for every subject and combination of levels.

use super::factor::{Factor, Groups, MOST_FACTORS, places_at};
use super::missing::LeftOut;
use crate::error::{PsychophysicsError, Result};

/// Bounds on the largest value: sphericity needs fourth powers, even of rounding errors.
pub(crate) const MOST_SIZE: f64 = 1e60;
pub(crate) const LEAST_SIZE: f64 = 1e-60;

/// Values of all subjects in all combinations of the levels, averaged over rounds.
///
/// Shape: subjects × cells; the last factor within subjects varies fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    pub(super) subjects: Vec<String>,
    pub(super) within: Vec<Factor>,
    pub(super) between: Option<Groups>,
    pub(super) values: Vec<f64>,
    pub(super) rounds: usize,
    /// The smallest single answer behind each value.
    pub(super) least: Vec<TrialAnswer>,
    pub(super) value_name: String,
    pub(super) left_out: Vec<LeftOut>,
    /// Rows of the table marked invalid.
    pub(super) invalid_rows: usize,
}

/// The answer of a single trial, and its line in the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrialAnswer {
    pub(super) value: f64,
    pub(super) line: u64,
}

impl Study {
    /// A study from its values: subject by subject, the last factor fastest.
    ///
    /// # Errors
    /// A wrong number of values or groups, a value that is not finite, a factor of one level, no factor at all, two
    /// factors of the same name, a largest size outside 1e-60 to 1e60 unless all values are zero.
    pub fn from_values(
        within: Vec<Factor>,
        between: Option<Groups>,
        values: Vec<f64>,
    ) -> Result<Self> {
        let cells = Factor::combinations(&within);
        let subjects = between
            .as_ref()
            .map_or(values.len() / cells.max(1), |g| g.of_subject.len());
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(PsychophysicsError::NotANumber {
                line: at as u64 + 1,
                column: "value".to_owned(),
                text: values[at].to_string(),
            });
        }
        let least = values.iter().zip(1..);
        let least = least
            .map(|(&value, line)| TrialAnswer { value, line })
            .collect();
        Self {
            subjects: (1..=subjects).map(|s| s.to_string()).collect(),
            within,
            between,
            values,
            rounds: 1,
            least,
            value_name: "value".to_owned(),
            left_out: Vec::new(),
            invalid_rows: 0,
        }
        .checked()
    }

    /// Accepts a study from a reader if it can be analysed.
    pub(super) fn checked(self) -> Result<Self> {
        let got = self.within.len();
        // One factor is enough, if it is between subjects.
        if got == 0 && self.between.is_none() || got > MOST_FACTORS {
            let most = MOST_FACTORS;
            return Err(PsychophysicsError::FactorCount { got, most });
        }
        let factors: Vec<&Factor> = self.within.iter().chain(self.group_factor()).collect();
        for factor in &factors {
            if factor.levels.len() < 2 {
                return Err(PsychophysicsError::OneLevel {
                    factor: factor.name.clone(),
                    level: factor.levels.first().cloned().unwrap_or_default(),
                });
            }
        }
        for (place, factor) in factors.iter().enumerate() {
            if factors[..place].iter().any(|f| f.name == factor.name) {
                let factor = factor.name.clone();
                return Err(PsychophysicsError::FactorTwice { factor });
            }
        }
        if self.values.is_empty() {
            return Err(PsychophysicsError::NoRows);
        }
        let wanted = self.subjects.len().saturating_mul(self.cells());
        if self.values.len() != wanted {
            return Err(PsychophysicsError::Length {
                what: "values",
                got: self.values.len(),
                wanted,
            });
        }
        if let Some(groups) = &self.between {
            let count = groups.factor.levels.len();
            let sizes = self.group_sizes();
            if groups.of_subject.iter().any(|&g| g >= count) || sizes.contains(&0) {
                return Err(PsychophysicsError::Length {
                    what: "groups with subjects",
                    got: sizes.iter().filter(|&&n| n > 0).count(),
                    wanted: count,
                });
            }
        }
        self.check_scale()?;
        Ok(self)
    }

    /// Refuses values whose sums of squares overflow or underflow.
    pub(super) fn check_scale(&self) -> Result<()> {
        let sizes = self.values.iter().map(|v| v.abs()).zip(&self.least);
        let Some((size, least)) = sizes.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return Ok(());
        };
        if size == 0.0 || (LEAST_SIZE..=MOST_SIZE).contains(&size) {
            return Ok(());
        }
        Err(PsychophysicsError::Scale {
            line: least.line,
            value: size,
        })
    }

    /// The same study with other values, one for each of [`Study::values`].
    pub(crate) fn with_values(&self, values: Vec<f64>) -> Self {
        debug_assert_eq!(values.len(), self.values.len());
        Self {
            values,
            ..self.clone()
        }
    }

    /// Number of rows left out as invalid by [`Columns::valid`](super::Columns::valid).
    #[must_use]
    pub const fn invalid_rows(&self) -> usize {
        self.invalid_rows
    }

    /// Subjects who were left out, with [`Missing::CompleteCases`](super::Missing::CompleteCases).
    #[must_use]
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// Names of the subjects, in order of appearance.
    #[must_use]
    pub fn subjects(&self) -> &[String] {
        &self.subjects
    }

    /// The factors within subjects.
    #[must_use]
    pub fn within(&self) -> &[Factor] {
        &self.within
    }

    /// The factor between subjects, if any.
    #[must_use]
    pub const fn between(&self) -> Option<&Groups> {
        self.between.as_ref()
    }

    /// All factors: the one between subjects first, then those within.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        self.group_factor().into_iter().chain(&self.within)
    }

    fn group_factor(&self) -> Option<&Factor> {
        self.between.as_ref().map(|groups| &groups.factor)
    }

    /// All values: subject by subject, the last factor fastest.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Name of the column of values.
    #[must_use]
    pub fn value_name(&self) -> &str {
        &self.value_name
    }

    /// Number of combinations of levels within subjects.
    #[must_use]
    pub fn cells(&self) -> usize {
        Factor::combinations(&self.within)
    }

    /// Number of trials averaged into each value.
    #[must_use]
    pub const fn rounds(&self) -> usize {
        self.rounds
    }

    /// The values of each subject in turn, one per cell.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.cells())
    }

    /// Group of a subject; 0 without a factor between subjects.
    pub(crate) fn group_of(&self, subject: usize) -> usize {
        self.between.as_ref().map_or(0, |g| g.of_subject[subject])
    }

    /// Number of subjects in each group; all subjects without a factor between subjects.
    #[must_use]
    pub fn group_sizes(&self) -> Vec<usize> {
        let Some(groups) = &self.between else {
            return vec![self.subjects.len()];
        };
        let mut sizes = vec![0; groups.factor.levels.len()];
        for &group in &groups.of_subject {
            if let Some(size) = sizes.get_mut(group) {
                *size += 1;
            }
        }
        sizes
    }

    /// Level of every factor within subjects in a cell.
    #[must_use]
    pub fn levels_of(&self, cell: usize) -> Vec<usize> {
        places_at(&self.within, cell)
    }

    /// A cell in words: `orientation=45, velocity=20`.
    #[must_use]
    pub fn cell_name(&self, cell: usize) -> String {
        let levels = self.levels_of(cell);
        let named = self.within.iter().zip(levels);
        let words: Vec<String> = named
            .map(|(f, l)| format!("{}={}", f.name, f.levels[l]))
            .collect();
        words.join(", ")
    }
}
