//! Where the hand is: with its reach, beside the surfaces, on one of them.

pub(super) mod free_side;
pub(super) mod phase;
pub(super) mod place;
pub(super) mod resting;
pub(super) mod straight_way;
