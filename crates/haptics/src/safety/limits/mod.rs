//! What arm, board and contact may do: to themselves, to the joints, to a person.

pub(in crate::safety) mod braking;
pub(in crate::safety) mod contact_limits;
pub(in crate::safety) mod load;
pub(in crate::safety) mod motion_guard;
pub(in crate::safety) mod person;
