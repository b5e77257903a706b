//! As much of HTTP as one page needs.

mod host;
pub(crate) mod request;
pub(crate) mod response;
