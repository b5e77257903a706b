#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod client;
pub mod codec;
pub mod controller;
mod error;
mod limits;
mod wrench;

pub use client::{
    ClientStatistics, FriClient, FriClientConfig, MOST_BEHIND_S, Transport, UdpTransport, Unfit,
};
pub use codec::{Codec, FriVersion};
pub use error::{ControllerError, FriError};
pub use limits::LimitViolation;
