//! The main job with real hands: those that a bridge brings from a headset's browser or a mouse.

mod driven;
mod flags;
pub(crate) mod holds;
mod preparation;
mod recorded;
mod simulated;
mod told;
mod touching;

pub use driven::{Driven, brake};
pub use flags::{HandChoice, LiveFlags};
pub use holds::Holds;
pub use preparation::{Prepared, prepare};
pub use recorded::asked;
pub use simulated::run_simulated;

use hwall_bridge::{BridgeServer, UnityConfig};
use hwall_fri::FriClientConfig;

/// Until the server stops, or the time is over: hands of the clients, or datagrams, lead the simulated arm, or an arm behind FRI.
///
/// # Errors
/// A command that the simulated arm refuses, a controller that is silent, an address that cannot be listened on; a recording that
/// cannot be written.
pub fn run(server: &BridgeServer, prepared: Prepared, flags: &LiveFlags) -> anyhow::Result<()> {
    match (flags.unity_udp, flags.fri) {
        (Some(listen), _) => {
            let config = UnityConfig {
                listen,
                ..UnityConfig::default()
            };
            told::run_told(server, &prepared, config, flags)
        }
        (None, Some(listen)) => {
            let config = FriClientConfig {
                listen,
                controller: flags.fri_controller,
                version: flags.fri_version,
                ..FriClientConfig::default()
            };
            driven::run_driven(server, prepared, config, flags)
        }
        (None, None) => run_simulated(server, prepared, flags),
    }
}
