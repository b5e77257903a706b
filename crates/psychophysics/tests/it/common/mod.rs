//! What the tests share.

pub(crate) mod deviation;
pub(crate) mod files;
