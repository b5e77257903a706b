//! What is looked at in every cycle: is it to be believed, is it obeyed, is it possible?

pub(in crate::safety) mod agreement;
pub(in crate::safety) mod clock;
pub(in crate::safety) mod face_pushes;
pub(in crate::safety) mod inspection;
pub(in crate::safety) mod obedience;
pub(in crate::safety) mod state_consistency;
pub(in crate::safety) mod target_leaps;
pub(in crate::safety) mod torque_bias;
pub(in crate::safety) mod watchdog;
