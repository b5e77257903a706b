//! An arm at servo level, and the fingertip that presses its board.

mod hand_contact;
mod servo;

pub use hand_contact::HandContact;
pub use servo::{ServoArm, ServoConfig};
