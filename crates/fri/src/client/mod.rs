//! A client: an `Arm` for a real or simulated controller.

mod arm;
mod asked_path;
mod beginning;
mod braking;
mod commanded;
mod config;
mod fri_client;
mod newest;
mod transport;
pub(crate) mod unfit;
mod velocity;

pub use asked_path::MOST_BEHIND_S;
pub(crate) use braking::CommandedMotion;
pub use config::{ClientStatistics, FriClientConfig};
pub use fri_client::FriClient;
pub use transport::{Transport, UdpTransport};
pub use unfit::Unfit;
