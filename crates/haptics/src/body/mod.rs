//! The bodies of the arm and of people as capsules, the room around them, and the distance to keep between them.

mod arm_body;
mod capsule;
mod person_body;
mod room;
mod separation;

pub use arm_body::{ArmBody, ArmCapsules, ArmPart, BodyConfig, LeftOut, Nearest};
pub use capsule::Capsule;
pub use person_body::{BodyRegion, PersonBody, PersonBodyConfig};
pub use room::{Obstacle, Room};
pub use separation::{Gap, Separation, SeparationConfig};
