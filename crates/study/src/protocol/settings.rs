//! The settings of a study.

use crate::error::StudyError;
use hwall::numeric::check::that;
use hwall::psychophysics::{Factor as StudyFactor, Schedule, TrialOrder as ScheduleOrder};
use serde::{Deserialize, Serialize};

/// Order of conditions within a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrialOrder {
    /// Random; no condition occurs twice in a row.
    #[default]
    Random,
    /// Rows of a balanced Latin square over subjects and blocks.
    Latin,
}

/// The question after a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Procedure {
    /// Magnitude estimation: any number above zero, in proportion to the sensation.
    #[default]
    Magnitude,
    /// A point on a scale from 1 to `points`.
    Likert {
        /// Points, 2 to 100.
        points: u8,
    },
    /// Two touches, one of the trial's condition and one of a fixed whiteboard without the arm, in random order: which felt more
    /// like a real wall, from 1 (the first, clearly) to `points` (the second, clearly).
    MoreReal {
        /// Points, 2 to 100; with an odd number, the middle point means no difference.
        points: u8,
    },
    /// Which of two was rougher: 1 or 2. One of the two is the trial's condition, the other the first condition of the study,
    /// in random order.
    TwoIntervals,
    /// As `TwoIntervals`, but the answers choose the condition: harder after two right ones, easier after a wrong one. One
    /// factor; its first level is the reference, and later levels are easier to discriminate from it.
    Staircase,
    /// As `Staircase`, but QUEST+ chooses the condition with the largest expected information.
    Quest,
}

impl Procedure {
    /// Are two touches compared?
    #[must_use]
    pub const fn is_two_intervals(self) -> bool {
        matches!(
            self,
            Self::MoreReal { .. } | Self::TwoIntervals | Self::Staircase | Self::Quest
        )
    }

    /// Points of the scale of the answers; `None` for other answers.
    #[must_use]
    pub const fn points(self) -> Option<u8> {
        match self {
            Self::Likert { points } | Self::MoreReal { points } => Some(points),
            _ => None,
        }
    }

    /// The answer, if the procedure accepts it.
    ///
    /// # Errors
    /// An answer that it does not accept; NaN is never accepted.
    pub fn check(self, answer: f64) -> Result<f64, StudyError> {
        let (holds, wanted) = match self {
            Self::Magnitude => (
                (1e-9..=1e9).contains(&answer),
                "a number above zero, 1e-9 to 1e9",
            ),
            Self::Likert { points } | Self::MoreReal { points } => (
                (1.0..=f64::from(points)).contains(&answer) && answer.fract() == 0.0,
                "a whole number from 1 to the end of the scale",
            ),
            Self::TwoIntervals | Self::Staircase | Self::Quest => {
                (answer == 1.0 || answer == 2.0, "1 or 2")
            }
        };
        if holds {
            return Ok(answer);
        }
        Err(StudyError::BadAnswer { answer, wanted })
    }
}

/// The settings of a whole study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Title of the report.
    pub title: String,
    /// Factors within subjects; their combinations are the conditions, the last factor fastest.
    pub factors: Vec<StudyFactor>,
    /// Subjects.
    pub subjects: usize,
    /// Blocks; each holds every condition once.
    pub repeats: usize,
    /// Order within blocks.
    pub order: TrialOrder,
    /// The question after each trial.
    pub procedure: Procedure,
    /// Custom questions: one for each level of the factor `question`, or one for all trials; empty: the question of the procedure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub questions: Vec<String>,
    /// Practice trials before the first block; they do not count.
    pub practice: usize,
    /// Trials per block that are repeated immediately to measure the agreement of answers; they do not count.
    pub catch_per_block: usize,
    /// Trials between breaks; 0: no breaks.
    pub break_after: usize,
    /// Attempts at a trial before it is left out; a late board or a lost hand spoils an attempt.
    pub most_attempts: u32,
    /// Seed of all orders.
    pub seed: u64,
}

/// Upper bounds of a study.
const MOST_SUBJECTS: usize = 1000;
const MOST_TRIALS: usize = 100_000;

/// The factor whose levels select the question.
const QUESTION: &str = "question";

/// Columns of the exported table besides the factors.
const TAKEN: [&str; 12] = [
    "subject",
    "round",
    "trial",
    "condition",
    "block",
    "answer",
    "answered_s",
    "valid",
    "why_not",
    "kind",
    "attempt",
    "",
];

impl Default for Protocol {
    /// The dissertation's study of roughness: 25 subjects, five orientations and five speeds; one block.
    fn default() -> Self {
        Self {
            title: "roughness by orientation and speed".to_owned(),
            factors: vec![
                StudyFactor::new("angle", ["0", "45", "63.43", "71.57", "90"]),
                StudyFactor::new("speed", ["0", "20", "40", "60", "80"]),
            ],
            subjects: 25,
            repeats: 1,
            order: TrialOrder::Random,
            procedure: Procedure::Magnitude,
            questions: Vec::new(),
            practice: 3,
            catch_per_block: 2,
            break_after: 50,
            most_attempts: 3,
            seed: 1,
        }
    }
}

impl Protocol {
    /// Conditions: combinations of levels.
    #[must_use]
    pub fn conditions(&self) -> usize {
        StudyFactor::combinations(&self.factors)
    }

    /// Level of every factor in a condition; `None` beyond [`Protocol::conditions`].
    #[must_use]
    pub fn levels(&self, condition: usize) -> Option<Vec<&str>> {
        StudyFactor::levels_at(&self.factors, condition)
    }

    /// The pseudonym of a subject, counted from 0: `S01`.
    #[must_use]
    pub fn pseudonym(&self, subject: usize) -> String {
        let width = self.subjects.to_string().len().max(2);
        format!("S{:0width$}", subject + 1)
    }

    /// Rejects a study that cannot be run.
    ///
    /// # Errors
    /// The first setting outside its range.
    pub fn validate(&self) -> Result<(), StudyError> {
        for (what, count, most) in [
            ("factors", self.factors.len(), 4),
            ("subjects", self.subjects, MOST_SUBJECTS),
            ("repeats", self.repeats, 10_000),
            ("conditions", self.conditions(), 10_000),
            ("most_attempts", self.most_attempts as usize, 100),
        ] {
            let holds = (1..=most).contains(&count);
            that(holds, what, count as f64, "at least 1, and not huge")?;
        }
        for (what, count) in [
            ("practice", self.practice),
            ("catch_per_block", self.catch_per_block),
        ] {
            that(count <= 1000, what, count as f64, "at most 1000")?;
        }
        let all = [self.conditions(), self.repeats].into_iter();
        let all = all.fold(self.subjects, usize::saturating_mul);
        that(all <= MOST_TRIALS, "trials", all as f64, "at most 1e5")?;
        if let Some(points) = self.procedure.points() {
            let holds = (2..=100).contains(&points);
            that(holds, "points of the scale", points.into(), "2 to 100")?;
        }
        for factor in &self.factors {
            let name = factor.name.trim();
            if TAKEN.contains(&name) || name != factor.name {
                let factor = factor.name.clone();
                return Err(StudyError::UnknownFactor { factor });
            }
            for (place, level) in factor.levels.iter().enumerate() {
                let plain =
                    !level.is_empty() && level.len() <= 100 && !level.chars().any(char::is_control);
                // 0 and 0.0 are the same level for readers of the table.
                let number = |text: &String| text.parse::<f64>().ok().filter(|v| v.is_finite());
                let same = |other: &String| {
                    other == level || number(other).is_some_and(|v| Some(v) == number(level))
                };
                if !plain || factor.levels[..place].iter().any(same) {
                    return Err(StudyError::BadLevel {
                        factor: name.to_owned(),
                        level: level.clone(),
                        wanted: "a short text that stands once",
                    });
                }
            }
        }
        self.check_questions()?;
        if matches!(self.procedure, Procedure::Staircase | Procedure::Quest) {
            self.rising_levels()?;
        }
        // Checks for duplicate names and too large squares.
        self.schedule().validate()?;
        Ok(())
    }

    fn check_questions(&self) -> Result<(), StudyError> {
        let of_levels = self.factors.iter().find(|f| f.name == QUESTION);
        let asked = self.questions.len();
        let enough = match of_levels {
            None => asked <= 1,
            Some(factor) => asked == factor.levels.len(),
        };
        let plain = |text: &String| {
            !text.trim().is_empty() && text.len() <= 500 && !text.chars().any(char::is_control)
        };
        let holds = enough && self.questions.iter().all(plain);
        let wanted =
            "a short line for each level of the factor question; without that factor one at most";
        that(holds, "questions", asked as f64, wanted)?;
        Ok(())
    }

    /// The custom question in a condition; `None` for the question of the procedure.
    #[must_use]
    pub fn question(&self, condition: usize) -> Option<&str> {
        let place = self.factors.iter().position(|f| f.name == QUESTION);
        let asked = match place {
            None => 0,
            Some(place) => {
                let level = *self.levels(condition)?.get(place)?;
                self.factors[place].levels.iter().position(|l| l == level)?
            }
        };
        self.questions.get(asked).map(String::as_str)
    }

    /// The reference condition of trials with two touches: the first condition, or an index one past the last condition, which
    /// [`Stimulus::of`](crate::Stimulus::of) maps to the whiteboard.
    #[must_use]
    pub fn reference(&self) -> usize {
        match self.procedure {
            Procedure::MoreReal { .. } => self.conditions(),
            _ => 0,
        }
    }

    /// The levels of the only factor as numbers, the first above zero.
    ///
    /// # Errors
    /// More than one factor, fewer than three levels, levels that are not increasing numbers.
    pub fn rising_levels(&self) -> Result<Vec<f64>, StudyError> {
        let [factor] = &self.factors[..] else {
            let got = self.factors.len();
            return Err(StudyError::SeveralFactors { got });
        };
        let mut numbers: Vec<f64> = Vec::new();
        for level in &factor.levels {
            let number = level.parse().ok();
            let least = numbers.last().copied().unwrap_or(0.0);
            let number = number.filter(|n: &f64| n.is_finite() && *n > least);
            numbers.push(number.ok_or_else(|| StudyError::BadLevel {
                factor: factor.name.clone(),
                level: level.clone(),
                wanted: "a number above the one before, the first above zero",
            })?);
        }
        if numbers.len() < 3 {
            return Err(StudyError::FewLevels {
                factor: factor.name.clone(),
                got: numbers.len(),
            });
        }
        Ok(numbers)
    }

    pub(super) fn schedule(&self) -> Schedule {
        Schedule {
            factors: self.factors.clone(),
            subjects: self.subjects,
            rounds: self.repeats,
            order: match self.order {
                TrialOrder::Random => ScheduleOrder::RandomisedBlocks,
                TrialOrder::Latin => ScheduleOrder::BalancedLatinSquare,
            },
            seed: self.seed,
        }
    }
}
