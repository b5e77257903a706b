//! The main job with real hands: those that a bridge brings from a headset's browser or a mouse.

mod driven;
mod preparation;
mod simulated;
mod told;
mod touching;

pub use driven::run_driven;
pub use preparation::{LiveOptions, Prepared, prepare};
pub use simulated::run_simulated;
pub use told::run_told;
