//! Data that lie beside the project and may be absent.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Path of a file or folder under `../shared` of the project; `None` where it is absent.
///
/// The calling test then ends early, and a line `skipped: ...` that no test runner captures says so: a test
/// that did not run must not look like one that passed.
#[must_use]
pub fn shared(path: &str) -> Option<PathBuf> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let found = shared.join(path);
    if found.exists() {
        return Some(found);
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test").to_owned();
    // Written past the capture of `eprintln!`; if even that fails there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "skipped: {test}: no ../shared/{path}");
    None
}
