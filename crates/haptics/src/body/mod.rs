//! The bodies of the arm and of the person, as capsules, and the distance that has to stay between them.

mod arm_body;
mod capsule;
mod person_body;
mod separation;

pub use arm_body::{ArmBody, ArmCapsules, BodyConfig};
pub use capsule::Capsule;
pub use person_body::{BodyRegion, PersonBody, PersonBodyConfig};
pub use separation::{Gap, Separation, SeparationConfig};
