//! Check whether two paths are the same file.

use std::fs;
use std::path::{Path, PathBuf};

/// Do both paths lead to the same file? Works even if neither exists yet; follows links, on Unix also hard links.
///
/// Pipes and devices are never the same: a terminal may be read and written.
#[must_use]
pub fn same_file(a: impl AsRef<Path>, b: impl AsRef<Path>) -> bool {
    let (a, b) = (a.as_ref(), b.as_ref());
    if let (Ok(one), Ok(other)) = (fs::metadata(a), fs::metadata(b)) {
        let plain = |data: &fs::Metadata| data.is_file() || data.is_dir();
        if !plain(&one) || !plain(&other) {
            return false;
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            return (one.dev(), one.ino()) == (other.dev(), other.ino());
        }
    }
    match (resolved(a), resolved(b)) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}

/// The path without links; works if only the folder exists.
fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(path) = fs::canonicalize(path) {
        return Some(path);
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    Some(fs::canonicalize(folder).ok()?.join(path.file_name()?))
}
