//! The interaction primitive of the hand, and its training.

pub(super) mod hand_primitive;
pub(super) mod training;
