//! Limits for contact with people, and the supervisor that stands between a renderer and the arm.

mod capsule;
mod contact_limits;
mod load;
mod motion_guard;
mod person;
mod state;
mod supervisor;
mod watchdog;

pub use capsule::{ArmCapsules, Capsule, CapsuleConfig};
pub use contact_limits::ContactLimits;
pub use load::{BoardLoad, LoadLimits};
pub use motion_guard::{GuardLimits, WorkspaceBox};
pub use person::{PersonLimits, PersonPart, PersonPoint};
pub use state::{Channel, SafeReason, SafeRequest, SafeState};
pub use supervisor::{Supervisor, SupervisorConfig, SupervisorInput, SupervisorStep, TimingConfig};
pub use watchdog::{ChannelWatch, Watch, WatchFault};
