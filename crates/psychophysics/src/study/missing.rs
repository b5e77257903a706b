//! What becomes of subjects without an answer for every cell.

/// What is done about missing answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Missing {
    /// The study is refused, with the first missing cell.
    #[default]
    Refuse,
    /// Complete cases: subjects with a missing cell are left out, and [`Study::left_out`](super::Study::left_out) names them.
    /// Right only if what is missing has nothing to do with the answer that was not given.
    CompleteCases,
}

/// A subject who was left out.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// Who.
    pub subject: String,
    /// The first of its cells without an answer.
    pub cell: String,
    /// How many of its answers are missing.
    pub missing: usize,
}
