//! The main job with real hands, from a headset's browser or a mouse through a bridge.

mod driven;
mod flags;
pub(crate) mod holds;
mod preparation;
mod recorded;
mod simulated;
mod told;
mod touching;

pub use driven::{Driven, brake};
pub use flags::{HandChoice, LedArmFlags, LiveFlags};
pub use holds::{Holds, heed_console, tell_left_out};
pub use preparation::{Prepared, prepare};
pub use recorded::{after, asked};
pub use simulated::run_simulated;

use hwall_bridge::{BridgeServer, UnityConfig};

/// Until the server stops or time is up, clients' hands or datagrams lead the simulated arm or an arm behind FRI.
///
/// # Errors
/// A command that the simulated arm refuses; a silent controller; an address that cannot be bound; a recording that
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
            driven::run_driven(server, prepared, flags.led.client(listen), flags)
        }
        (None, None) => run_simulated(server, prepared, flags),
    }
}
