//! Limits for contact with people, and the supervisor that stands between a renderer and the arm.
//!
//! # What the supervisor does
//!
//! `safety::Supervisor` stands between whatever makes commands and the arm, at servo and at torque level. Each cycle it takes
//! state, the person's points, target, force and command, and gives back the command to send, a `SafeState` with its reason, and a
//! request to the renderer.
//!
//! | found | answer | then, if it lasts |
//! | --- | --- | --- |
//! | near a person, faster than a joint or a torque rate allows | `Slowed`: cut, to rest where a part of the arm could meet head or torso (`body::Separation`) | normal as soon as it is over |
//! | head or fingertip not tracked so far (`SupervisorConfig::required`) | `Holding` | normal once they are |
//! | hand, head, target, torque or force lost, leaping, frozen or NaN; a push at the edge; a push on the arm while no hand is near the board | `Holding` | `Retreating` after 0.3 s, `Stopped` after 1.5 s more |
//! | arm's angles, speeds or clock lost, leaping, frozen or NaN; a command that is NaN, leaps, leaves the box or folds the arm into itself | `Holding` | `Stopped` after 0.3 s |
//! | more force than a hand may meet | `Retreating` at once (torque level: `Compliant`), latched: every joint moves the way that it is pushed | `Stopped` after 1.5 s, but not above 65 N (torque level: `Holding` as soon as it is below 65 N, `Stopped` 0.3 s later) |
//! | a force that no hand exerts, an arm beyond its limits, one that is not where it was commanded to be or drifts in a hold (`ObedienceConfig`) | `Holding`, latched | `Stopped` after 0.3 s |
//!
//! Every fault is answered in the cycle in which it is found, and no chain of answers is longer than
//! `SupervisorConfig::longest_to_last_state_s`. Commands go through again when all inputs were sound for 0.25 s; what is latched
//! needs `Supervisor::reset`. A request to retreat is carried out by the renderer; whatever it commands meanwhile is cut to 0.1 m/s
//! and not let forward, unless it gives way to a push: then to 0.25 m/s.
//!
//! Limits of contact are named after ISO/TS 15066. Secondary publications quote it with different numbers: every one is a field of
//! `ContactLimits` with its default beside it, for whoever runs a set-up to confirm. This is software on an ordinary computer,
//! not a safety-rated function: it comes on top of those of the arm's own controller, not in their place.

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
