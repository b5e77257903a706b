//! Questions and answers as they go over the line.

use serde::{Deserialize, Serialize};

/// How a question is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Answering {
    /// A number above zero, typed in.
    Number,
    /// A point of a scale from 1, one button each.
    Scale {
        /// Points, at most 100.
        points: u8,
    },
    /// The first or the second: two large buttons; the answer is 1 or 2.
    Two,
    /// One button, to go on; the answer is 1.
    Continue,
}

impl Answering {
    /// Is this an answer to such a question?
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

/// A question. It says nothing about the condition that it is about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Question {
    /// What is asked, in words.
    pub text: String,
    /// How it is answered.
    #[serde(flatten)]
    pub answering: Answering,
}

/// What the page is told.
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

/// What the page says.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Said {
    /// The answer to the question of a number.
    Answer { id: u64, value: f64 },
}
