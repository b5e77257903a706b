#![doc = include_str!("../README.md")]

pub mod codec;
mod error;

pub use codec::{Codec, FriVersion};
pub use error::{ControllerError, FriError};
