//! The interaction primitive of the hand, and how it is trained.

pub(super) mod hand_primitive;
pub(super) mod training;
