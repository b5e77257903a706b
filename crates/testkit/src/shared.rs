//! Data outside the project, which may be absent.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Path of a file or folder under `../shared` of the project; `None` if it is absent.
///
/// If absent, the calling test should end early. A line `skipped: ...`, which no test runner captures, reports this, so that
/// a skipped test does not look like a passed one.
#[must_use]
pub fn shared(path: &str) -> Option<PathBuf> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let found = shared.join(path);
    if found.exists() {
        return Some(found);
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test").to_owned();
    // Bypasses the capture of `eprintln!`; ignore a failure.
    let _ = writeln!(std::io::stderr(), "skipped: {test}: no ../shared/{path}");
    None
}
