//! The dissertation's datagram, for its Unity side.

mod datagram;
mod receiver;

pub use datagram::{BoardDatagram, RoughnessCode};
pub use receiver::{UnityConfig, UnityReceiver, UnityTarget};
