//! Shared by the tests.

pub(crate) mod bumps;
pub(crate) mod refusals;
pub(crate) mod scratch;
