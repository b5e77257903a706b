//! Present, previous and idle fixations.

pub(in crate::predict) mod idle;
pub(in crate::predict) mod memory;
