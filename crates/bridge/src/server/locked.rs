//! The lock of what threads share.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// A thread that panicked leaves nothing half done here: every change is one assignment.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
