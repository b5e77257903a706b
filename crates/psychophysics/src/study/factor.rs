//! Factors and their levels.

/// Largest number of factors within subjects: interactions of five factors cannot be interpreted.
pub const MOST_FACTORS: usize = 4;

/// A factor and its levels in order.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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

    /// Combinations of levels, at most `usize::MAX`.
    #[must_use]
    pub fn combinations(factors: &[Self]) -> usize {
        let counts = factors.iter().map(|f| f.levels.len());
        counts.fold(1, usize::saturating_mul)
    }

    /// Level of every factor in a combination, the last factor fastest; `None` beyond [`Factor::combinations`].
    #[must_use]
    pub fn levels_at(factors: &[Self], combination: usize) -> Option<Vec<&str>> {
        if combination >= Self::combinations(factors) {
            return None;
        }
        let places = factors.iter().zip(places_at(factors, combination));
        Some(places.map(|(f, l)| f.levels[l].as_str()).collect())
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

/// Place of every factor's level in a combination, the last factor fastest.
pub(crate) fn places_at(factors: &[Factor], mut combination: usize) -> Vec<usize> {
    let mut places = vec![0; factors.len()];
    for (place, factor) in places.iter_mut().zip(factors).rev() {
        *place = combination % factor.levels.len();
        combination /= factor.levels.len();
    }
    places
}
