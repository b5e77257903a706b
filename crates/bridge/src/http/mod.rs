//! The part of HTTP that one page needs.

mod host;
pub(crate) mod key;
pub(crate) mod request;
mod response;
pub(crate) mod serve;
pub(crate) mod stream;
