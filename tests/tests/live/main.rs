//! What runs in real time: sessions over sockets, pages in a browser. A program of its own, and one test at a time, because other
//! tests beside them would make these late.

mod bridge_in_a_browser;
mod browser;
mod headset_troubles;
mod live_recording;
mod study_in_a_browser;
mod study_over_fri;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Held while a test runs.
static ALONE: Mutex<()> = Mutex::new(());

/// Waits until no other test of this program runs.
fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}
