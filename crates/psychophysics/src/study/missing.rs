//! Handling of subjects with missing answers.

/// Handling of missing answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Missing {
    /// Refuse the study; the error names the first missing cell.
    #[default]
    Refuse,
    /// Complete cases: leave out subjects with a missing cell; [`Study::left_out`](super::Study::left_out) names them.
    /// Valid only if answers are missing independently of their value.
    CompleteCases,
}

/// A subject left out.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// Name of the subject.
    pub subject: String,
    /// The first of the subject's cells without an answer.
    pub cell: String,
    /// How many of the subject's answers are missing.
    pub missing: usize,
}
