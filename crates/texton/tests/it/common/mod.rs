//! Shared by the tests.

pub(crate) mod bumps;
#[cfg(feature = "exr")]
pub(crate) mod pictures;
pub(crate) mod refusals;
pub(crate) mod scratch;
