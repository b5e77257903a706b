//! Live filters: where the hand and the gaze are now, or that the hand is lost.

mod filter;
mod freeze;
mod gaze;
mod gaze_filter;
mod gaze_samples;
mod lost;
mod value_steps;

pub use filter::{HandFilter, HandFilterConfig, HandState, Tracking};
pub use freeze::{FreezeConfig, FreezeKind};
pub(crate) use freeze::{FreezeWatch, LATE};
pub use gaze::{Fixation, Gaze};
pub use gaze_filter::{GazeFilter, GazeFilterConfig};
pub use lost::LostReason;
pub(crate) use value_steps::ValueSteps;
