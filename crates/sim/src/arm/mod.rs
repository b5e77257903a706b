//! An arm at servo level, and the fingertip that presses its board.

mod config;
mod hand_contact;
mod servo;
mod stream;
mod tracking;

pub use config::ServoConfig;
pub use hand_contact::HandContact;
pub use servo::ServoArm;
