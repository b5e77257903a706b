//! Questions and answers, and their messages.

use serde::{Deserialize, Serialize};

/// How a question is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Answering {
    /// A positive number, typed in.
    Number,
    /// A point on a scale from 1, one button each.
    Scale {
        /// Points, at most 100.
        points: u8,
    },
    /// The first or the second: two large buttons; the answer is 1 or 2.
    Two,
    /// One button to continue; the answer is 1.
    Continue,
}

impl Answering {
    /// Is this a valid answer to such a question?
    #[must_use]
    pub fn fits(self, value: f64) -> bool {
        let last = match self {
            Self::Number => return value > 0.0 && value.is_finite(),
            Self::Scale { points } => f64::from(points),
            Self::Two => 2.0,
            Self::Continue => 1.0,
        };
        value.fract() == 0.0 && (1.0..=last).contains(&value)
    }
}

/// A question. It reveals nothing about the condition.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Question {
    /// What is asked, in words.
    pub text: String,
    /// How it is answered.
    #[serde(flatten)]
    pub answering: Answering,
}

/// A message to the page.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(super) enum Told<'a> {
    /// Nothing to answer now.
    Status { text: &'a str },
    /// A question with its number.
    Question {
        id: u64,
        #[serde(flatten)]
        question: &'a Question,
    },
}

impl Told<'_> {
    pub(super) fn to_json(&self) -> String {
        // Numbers and text always have a JSON form.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// A message from the page.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Said {
    /// The answer to the question with this number.
    Answer { id: u64, value: f64 },
}
