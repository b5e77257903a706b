//! Locks shared state.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Ignores poisoning: every change is one assignment, so a thread that panicked leaves nothing half done.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
