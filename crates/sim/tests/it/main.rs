//! Integration tests of the crate in one binary.

mod chain_motion;
mod common;
mod following;
mod glances;
mod hand_body;
mod joint_friction;
mod person;
mod servo;
mod torque_arm;
mod torque_sensing;
mod touch;
mod trait_rates;
mod traits;
