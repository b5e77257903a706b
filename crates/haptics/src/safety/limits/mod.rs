//! Limits of arm, board and contact.

pub(in crate::safety) mod braking;
pub(in crate::safety) mod contact_limits;
pub(in crate::safety) mod load;
pub(in crate::safety) mod motion_guard;
pub(in crate::safety) mod person;
