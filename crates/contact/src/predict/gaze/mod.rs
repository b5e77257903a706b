//! Where the eyes rest, rested before, and rest while nothing is meant.

pub(in crate::predict) mod idle;
pub(in crate::predict) mod memory;
