//! Live filters: the present hand and gaze, or the reason of a loss.

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
