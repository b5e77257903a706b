//! Checks in every cycle: are the inputs credible and possible, and does the arm obey?

pub(in crate::safety) mod agreement;
pub(in crate::safety) mod clock;
pub(in crate::safety) mod face_pushes;
pub(in crate::safety) mod inspection;
pub(in crate::safety) mod obedience;
pub(in crate::safety) mod state_consistency;
pub(in crate::safety) mod target_leaps;
pub(in crate::safety) mod torque_bias;
pub(in crate::safety) mod watchdog;
