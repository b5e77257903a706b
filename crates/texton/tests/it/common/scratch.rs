//! Temporary files of tests.

use std::path::{Path, PathBuf};

/// The path of a file of one test, which does not exist yet.
pub(crate) fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("texton-{name}"));
    let _ = std::fs::remove_file(&path);
    path
}
