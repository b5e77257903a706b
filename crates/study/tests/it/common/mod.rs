//! Shared by the tests.

use std::path::{Path, PathBuf};

/// A folder for one test, not created yet.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("study-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}
