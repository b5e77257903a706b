//! Encoding of the messages.

pub(crate) mod look;
pub(crate) mod session;
