//! Limits for contact with people, and the supervisor that stands between a renderer and the arm.

mod agreement;
mod braking;
mod capsule;
mod clock;
mod contact_limits;
mod cycle;
mod fault;
mod inspection;
mod load;
mod motion_guard;
mod obedience;
mod person;
mod state;
mod supervisor;
mod supervisor_config;
mod target_leaps;
mod torque_bias;
mod watchdog;
mod whereabouts;

pub use capsule::{ArmCapsules, Capsule, CapsuleConfig};
pub use contact_limits::ContactLimits;
pub use cycle::{SupervisorInput, SupervisorStep};
pub use load::{BoardLoad, LoadLimits};
pub use motion_guard::{GuardLimits, WorkspaceBox};
pub use obedience::ObedienceConfig;
pub use person::{PersonLimits, PersonPart, PersonPoint};
pub use state::{Channel, SafeReason, SafeRequest, SafeState};
pub use supervisor::Supervisor;
pub use supervisor_config::{Latch, SupervisorConfig, TimingConfig};
pub use target_leaps::LeapLimits;
pub use torque_bias::BiasConfig;
pub use watchdog::{ChannelWatch, Watch, WatchFault};
