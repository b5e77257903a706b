//! Limits for contact with people, and the supervisor that stands between a renderer and the arm.

mod cycle;
mod fault;
mod limits;
mod state;
mod supervisor;
mod supervisor_config;
mod watch;
mod words;

pub use cycle::{SupervisorInput, SupervisorStep};
pub use limits::contact_limits::ContactLimits;
pub use limits::load::{BoardLoad, LoadLimits};
pub use limits::motion_guard::{GuardLimits, WorkspaceBox};
pub use limits::person::{PersonLimits, PersonPart, PersonPoint};
pub use state::{Channel, SafeReason, SafeRequest, SafeState};
pub use supervisor::Supervisor;
pub use supervisor_config::{Latch, SupervisorConfig, TimingConfig};
pub use watch::obedience::ObedienceConfig;
pub use watch::target_leaps::LeapLimits;
pub use watch::torque_bias::BiasConfig;
pub use watch::watchdog::{ChannelWatch, Watch, WatchFault};
