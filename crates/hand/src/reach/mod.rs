//! Reaches: movements of a hand from rest to a touch, in recordings and live streams.

mod label;
mod labelled;
mod onset;
mod segment;
mod touching_point;
mod watch;

pub use label::{LabelConfig, Labelled, LeftOut, ReachCut, labelled_reaches};
pub use labelled::LabelledReach;
pub use onset::ReachOnset;
pub use segment::{Reach, ReachEnd, SegmentConfig, reaches};
pub use touching_point::TouchingPoint;
pub use watch::{ReachWatch, WatchConfig, WatchUpdate};
