//! The main job with real hands: those that a bridge brings from a headset's browser or a mouse.

mod driven;
mod flags;
mod holds;
mod preparation;
mod recorded;
mod simulated;
mod told;
mod touching;

pub use driven::{Driven, brake, run_driven};
pub use flags::LiveFlags;
pub use holds::Holds;
pub use preparation::{HandChoice, LiveOptions, Prepared, prepare};
pub use simulated::run_simulated;
pub use told::run_told;

use hwall_bridge::{BridgeServer, UnityConfig};
use hwall_fri::FriClientConfig;

/// Who moves, and who says where to.
#[derive(Debug, Clone)]
pub enum LiveArm {
    /// The hands of the clients lead the simulated arm.
    Simulated,
    /// The hands of the clients lead an arm behind FRI.
    Fri(FriClientConfig),
    /// Datagrams lead the simulated arm.
    Told(UnityConfig),
}

/// Until the server stops, or the time is over.
///
/// # Errors
/// As for [`run_simulated`], [`run_driven`] and [`run_told`].
pub fn run(
    server: &BridgeServer,
    prepared: Prepared,
    arm: LiveArm,
    options: &LiveOptions<'_>,
) -> anyhow::Result<()> {
    match arm {
        LiveArm::Simulated => run_simulated(server, prepared, options),
        LiveArm::Fri(config) => run_driven(server, prepared, config, options),
        LiveArm::Told(config) => run_told(server, prepared, config, options),
    }
}
