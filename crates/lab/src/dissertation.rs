//! The numbers published in the dissertation ([H-Wall]), with chapter, figure or table. No other file repeats them.
//!
//! The means of experiment 2 are [`hwall_study::EXPERIMENT_2_MEANS`], because its simulated participants use them. Pages of the
//! dissertation are not among the sources of this project.

use hwall_testkit::{Column, MarkdownTable, table_of};

/// Chapter III: reaction of the arm to a command, ms.
pub const REACTION_MS: f64 = 22.0;
/// Chapter III: another delay, ms; its meaning is not among the sources.
pub const OTHER_DELAY_MS: f64 = 11.7;
/// Chapter IV: time for the map of one orientation by multi-start optimization, s.
pub const MAP_S: f64 = 3600.0;
/// The experiments with a whiteboard and with questions: people, and points of their scales.
pub const SUBJECTS: usize = 8;
/// See [`SUBJECTS`].
pub const POINTS: usize = 5;
/// Table V: F, and partial eta squared or p, of angle, speed and their interaction.
pub const TABLE_V: [&str; 3] = [
    "71.667, partial eta squared .3323 (table V)",
    "15.873, partial eta squared .0993 (table V)",
    "0.437, p = .9726 (table V)",
];
/// Order of the levels of angle (V-10) and of speed (V-11).
pub const ORDERS: [&str; 2] = [
    "0 < 45 < 63.43 ~ 71.57 ~ 90 (V-10)",
    "rises, 0 to 80 mm/s (V-11)",
];
/// Chapter V: number of distinguishable levels of roughness.
pub const LEVELS: &str = "at least 9";
/// Released code: time until the texture has its nominal speed, s.
pub const SPEED_AFTER_S: f64 = 1.5;
/// Chapter VI: mean errors of the predicted contact in x, y and z over 30 targets, cm.
pub const ERROR_MEAN_CM: [f64; 3] = [3.62, 5.43, 6.95];
/// The largest of these errors, cm.
pub const ERROR_MAX_CM: [f64; 3] = [9.96, 12.83, 12.94];

/// Text for a missing published number: none of the sources of this project gives it.
pub const NOT_HERE: &str = "not among this project's sources";

/// A published number and its reproduction.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it is.
    pub what: String,
    /// The published value and its place; or why there is none.
    pub published: String,
    /// The reproduced value.
    pub ours: String,
}

impl Row {
    /// A row.
    pub fn new(
        what: impl Into<String>,
        published: impl Into<String>,
        ours: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            published: published.into(),
            ours: ours.into(),
        }
    }

    /// The rows as a table.
    pub fn table(rows: &[Self]) -> MarkdownTable {
        let columns: [Column<'_, &Self>; 3] = [
            ("number", &|r| r.what.clone()),
            ("the dissertation", &|r| r.published.clone()),
            ("redone", &|r| r.ours.clone()),
        ];
        table_of(rows, &columns)
    }
}
