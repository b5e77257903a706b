//! The report of a study, with the numbers of its methods paragraph.

mod agreement;
mod document;
mod effects;
mod groups;
mod methods;
mod ratings;
mod scale;
mod thresholds;

pub use document::StudyReport;
pub use groups::{LevelGroups, level_groups};
pub use ratings::{RatingPower, Ratings, mean_power, ratings, sign_power};
