//! Sizes that are refused before memory is taken.

use crate::error::{ReachabilityError, Result};

/// More pairs of position and heading than this (64 megabytes of scores) are refused.
pub(super) const MOST_CANDIDATES: u128 = 1 << 24;

/// More boards (targets times rolls) than this, half a gigabyte, are refused.
pub(super) const MOST_BOARDS: u128 = 1 << 22;

/// More headings than this, ten to a degree, are refused.
pub(super) const MOST_HEADINGS: u128 = 3600;

pub(super) fn refuse_above(limit: u128, what: &'static str, count: u128) -> Result<()> {
    if count > limit {
        return Err(ReachabilityError::TooMany { what, count, limit });
    }
    Ok(())
}
