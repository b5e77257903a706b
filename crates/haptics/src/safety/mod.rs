//! Limits for contact with people, and the supervisor between a renderer and the arm.
//!
//! # What the supervisor does
//!
//! `safety::Supervisor` stands between any source of commands and the arm, at servo and at torque level. Each cycle it takes the state, the person's
//! points, the target, the force and the command. It returns the command to send, a `SafeState` with its reason, and a request to the renderer.
//!
//! | fault | response | then, if it lasts |
//! | --- | --- | --- |
//! | near a person, faster than a joint or a torque rate allows | `Slowed`: cut, down to rest where a part of the arm could meet head or torso (`body::Separation`) | normal as soon as it is over |
//! | head or fingertip not tracked so far (`SupervisorConfig::required`) | `Holding` | normal once they are |
//! | hand, head, bystander, target, torque or force lost, jumping, frozen or NaN; a push at the edge | `Holding` | `Retreating` after 0.3 s, `Stopped` after 1.5 s more |
//! | a push on the arm that no touch of the face explains | `Holding` until the arm rests, then `Retreating`: it yields for as long as it is pushed | normal after the push; if it returns, after twice as long each time, up to 5 s |
//! | arm's angles, speeds or clock lost, jumping, frozen or NaN; a command that is NaN, jumps, leaves the box or folds the arm into itself | `Holding` | `Stopped` after 0.3 s |
//! | more force than allowed on a hand | `Retreating` at once (torque level: `Compliant`), latched: every joint moves the way that it is pushed | `Stopped` after 1.5 s, but not above 65 N (torque level: `Holding` as soon as it is below 65 N, `Stopped` 0.3 s later) |
//! | an implausible force, an arm beyond its limits, one that is not where it was commanded to be or drifts in a hold (`ObedienceConfig`) | `Holding`, latched | `Stopped` after 0.3 s |
//!
//! Every fault is handled in the cycle in which it is found; the last state follows within `SupervisorConfig::longest_to_last_state_s`. Commands go
//! through again after all inputs were sound for 0.25 s; a latched fault needs `Supervisor::reset`. The renderer carries out a request to retreat;
//! meanwhile its commands are cut to 0.1 m/s and may not move forward. If it yields to a push, they are cut to 0.25 m/s.
//!
//! Contact limits are named after ISO/TS 15066. Secondary publications quote it with different numbers: every limit is a field of `ContactLimits`
//! with its default beside it, to be confirmed for each setup. This is software on an ordinary computer, not a safety-rated function: it adds to the
//! arm controller's own safety functions and does not replace them.

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
