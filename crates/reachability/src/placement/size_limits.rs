//! Size limits, checked before memory is allocated.

use crate::error::{ReachabilityError, Result};

/// Maximum number of position-heading pairs (64 megabytes of scores).
pub(super) const MOST_CANDIDATES: u128 = 1 << 24;

/// Maximum number of boards (targets times rolls): half a gigabyte.
pub(super) const MOST_BOARDS: u128 = 1 << 22;

/// Maximum number of headings: ten per degree.
pub(super) const MOST_HEADINGS: u128 = 3600;

pub(super) fn refuse_above(limit: u128, what: &'static str, count: u128) -> Result<()> {
    if count > limit {
        return Err(ReachabilityError::TooMany { what, count, limit });
    }
    Ok(())
}
