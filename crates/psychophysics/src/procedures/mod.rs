//! Procedures that choose the next stimulus from the answers so far, and thresholds with intervals.

mod quest;
mod staircase;
mod threshold;

pub use quest::{QuestEstimate, QuestGrid, QuestPlus};
pub use staircase::{Staircase, StaircaseConfig, StaircaseEstimate};
pub use threshold::{Threshold, threshold};
