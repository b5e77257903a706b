//! What the tests share.

pub(crate) mod bumps;
pub(crate) mod refusals;
pub(crate) mod scratch;
