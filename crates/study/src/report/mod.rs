//! What a study says, and the numbers of its methods paragraph.

mod document;
mod groups;
mod thresholds;

pub use document::StudyReport;
pub use groups::{LevelGroups, level_groups};
