//! Factors and their levels.

/// Largest number of factors within subjects: interactions of five factors cannot be interpreted.
pub const MOST_FACTORS: usize = 4;

/// A factor and its levels in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Factor {
    /// Name, as in the header of the table.
    pub name: String,
    /// Levels, ordered by value if all are numbers, and otherwise by first appearance.
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

    /// The levels as numbers, if all are.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let number = |l: &String| l.parse().ok().filter(|v: &f64| v.is_finite());
        self.levels.iter().map(number).collect()
    }
}

/// A factor between subjects, and the group of each subject.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Groups {
    /// The factor; its levels are the groups.
    pub factor: Factor,
    /// Group of every subject, counted from 0.
    pub of_subject: Vec<usize>,
}

/// Combinations of levels, at most `usize::MAX`.
pub(crate) fn count_cells(factors: &[Factor]) -> usize {
    let counts = factors.iter().map(|f| f.levels.len());
    counts.fold(1, usize::saturating_mul)
}
