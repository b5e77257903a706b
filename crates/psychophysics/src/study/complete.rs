//! A complete study: one value for every subject and combination of levels.

use crate::PsychophysicsError;

/// Factors within subjects, at most: nobody reads interactions of five.
pub const MOST_FACTORS: usize = 4;

/// Size of the largest value, at most and at least: sphericity takes fourth powers, down to those of
/// rounding.
pub(crate) const MOST_SIZE: f64 = 1e60;
pub(crate) const LEAST_SIZE: f64 = 1e-60;

/// A factor and its levels in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Factor {
    /// Name, as in the header of the table.
    pub name: String,
    /// Levels: by value where all are numbers, else by first appearance.
    pub levels: Vec<String>,
}

impl Factor {
    /// A factor.
    pub fn new<L: Into<String>>(
        name: impl Into<String>,
        levels: impl IntoIterator<Item = L>,
    ) -> Self {
        Self {
            name: name.into(),
            levels: levels.into_iter().map(Into::into).collect(),
        }
    }

    /// The levels as numbers, where all are.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let number = |l: &String| l.parse().ok().filter(|v: &f64| v.is_finite());
        self.levels.iter().map(number).collect()
    }
}

/// A factor between subjects, and who is in which of its groups.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Groups {
    /// The factor; its levels are the groups.
    pub factor: Factor,
    /// Group of every subject, counted from 0.
    pub of_subject: Vec<usize>,
}

/// Values of all subjects in all combinations of the levels, averaged over rounds.
///
/// Shape: subjects × cells; the last factor within subjects varies fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    subjects: Vec<String>,
    within: Vec<Factor>,
    between: Option<Groups>,
    values: Vec<f64>,
    rounds: usize,
    least: Vec<Least>,
    value_name: String,
}

/// The smallest single trial behind an averaged value, and its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Least {
    pub(crate) value: f64,
    pub(crate) line: u64,
}

/// The parts of a study as a reader collects them.
pub(crate) struct Parts {
    pub(crate) subjects: Vec<String>,
    pub(crate) within: Vec<Factor>,
    pub(crate) between: Option<Groups>,
    pub(crate) values: Vec<f64>,
    pub(crate) rounds: usize,
    pub(crate) least: Vec<Least>,
    pub(crate) value_name: String,
}

impl Study {
    /// A study from its values: subject by subject, the last factor fastest.
    ///
    /// # Errors
    /// A wrong number of values or groups, a value that is not finite, a factor of one level, no factor, two factors of one name,
    /// a largest size outside 1e-60 to 1e60 unless all values are zero.
    pub fn from_values(
        within: Vec<Factor>,
        between: Option<Groups>,
        values: Vec<f64>,
    ) -> Result<Self, PsychophysicsError> {
        let cells = count_cells(&within);
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
        let least = least.map(|(&value, line)| Least { value, line }).collect();
        Self::from_parts(Parts {
            subjects: (1..=subjects).map(|s| s.to_string()).collect(),
            within,
            between,
            values,
            rounds: 1,
            least,
            value_name: "value".to_owned(),
        })
    }

    pub(crate) fn from_parts(parts: Parts) -> Result<Self, PsychophysicsError> {
        let got = parts.within.len();
        if got == 0 || got > MOST_FACTORS {
            let most = MOST_FACTORS;
            return Err(PsychophysicsError::FactorCount { got, most });
        }
        let between = parts.between.as_ref().map(|g| &g.factor);
        for factor in parts.within.iter().chain(between) {
            if factor.levels.len() < 2 {
                return Err(PsychophysicsError::OneLevel {
                    factor: factor.name.clone(),
                    level: factor.levels.first().cloned().unwrap_or_default(),
                });
            }
        }
        let mut names: Vec<&str> = Vec::with_capacity(MOST_FACTORS + 1);
        for factor in parts.within.iter().chain(between) {
            if names.contains(&factor.name.as_str()) {
                let factor = factor.name.clone();
                return Err(PsychophysicsError::FactorTwice { factor });
            }
            names.push(&factor.name);
        }
        if parts.values.is_empty() {
            return Err(PsychophysicsError::NoRows);
        }
        let study = Self {
            subjects: parts.subjects,
            within: parts.within,
            between: parts.between,
            values: parts.values,
            rounds: parts.rounds,
            least: parts.least,
            value_name: parts.value_name,
        };
        let wanted = study.subjects.len().saturating_mul(study.cells());
        if study.values.len() != wanted {
            return Err(PsychophysicsError::Length {
                what: "values",
                got: study.values.len(),
                wanted,
            });
        }
        if let Some(groups) = &study.between {
            let count = groups.factor.levels.len();
            let sizes = study.group_sizes();
            if groups.of_subject.iter().any(|&g| g >= count) || sizes.contains(&0) {
                return Err(PsychophysicsError::Length {
                    what: "groups with subjects",
                    got: sizes.iter().filter(|&&n| n > 0).count(),
                    wanted: count,
                });
            }
        }
        study.check_scale()?;
        Ok(study)
    }

    /// Refuses values whose sums of squares overflow or vanish.
    pub(crate) fn check_scale(&self) -> Result<(), PsychophysicsError> {
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

    /// All factors: that between subjects first, then those within.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        let between = self.between.as_ref().map(|g| &g.factor);
        between.into_iter().chain(&self.within)
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

    /// Combinations of levels within subjects.
    #[must_use]
    pub fn cells(&self) -> usize {
        count_cells(&self.within)
    }

    /// Values averaged into each one.
    #[must_use]
    pub const fn rounds(&self) -> usize {
        self.rounds
    }

    /// The values of each subject in turn, one a cell.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.cells())
    }

    /// Group of a subject, 0 without a factor between subjects.
    pub(crate) fn group_of(&self, subject: usize) -> usize {
        self.between.as_ref().map_or(0, |g| g.of_subject[subject])
    }

    /// Subjects of each group; of all, without a factor between subjects.
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
    pub fn levels_of(&self, mut cell: usize) -> Vec<usize> {
        let mut levels = vec![0; self.within.len()];
        for (level, factor) in levels.iter_mut().zip(&self.within).rev() {
            *level = cell % factor.levels.len();
            cell /= factor.levels.len();
        }
        levels
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

    /// Smallest single trial behind each value.
    pub(crate) fn least(&self) -> &[Least] {
        &self.least
    }
}

/// Combinations of levels; more than fit in memory are as good as the most that do.
pub(crate) fn count_cells(factors: &[Factor]) -> usize {
    let counts = factors.iter().map(|f| f.levels.len());
    counts.fold(1, usize::saturating_mul)
}
