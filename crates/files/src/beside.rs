//! A temporary file beside the target, renamed when complete.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Makes temporary names unique within a process.
static COUNT: AtomicU64 = AtomicU64::new(0);
/// Names tried before giving up; only leftovers of a killed process with the same id can occupy a name.
const TRIES: usize = 100;

/// A file under construction: write to [`path`](Self::path), then [`finish`](Self::finish) gives it the target's name.
///
/// Dropped without `finish`, it is removed, and the old file stays unchanged.
#[derive(Debug)]
pub struct Beside {
    target: PathBuf,
    /// `None`: the target is a pipe or a device and is written directly.
    part: Option<PathBuf>,
}

impl Beside {
    /// Creates an empty file beside `target`.
    ///
    /// # Errors
    /// A folder that is missing or cannot be written to; a target that is a folder or write-protected.
    pub fn new(target: impl AsRef<Path>) -> io::Result<Self> {
        let named = target.as_ref();
        let (target, permissions) = match fs::metadata(named) {
            Ok(old) if old.is_dir() => {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
            }
            Ok(old) if !old.is_file() => {
                return Ok(Self {
                    target: named.to_owned(),
                    part: None,
                });
            }
            Ok(old) => {
                // A rename would bypass the write protection.
                OpenOptions::new().write(true).open(named)?;
                (fs::canonicalize(named)?, Some(old.permissions()))
            }
            Err(_) => (behind_links(named)?, None),
        };
        let (part, file) = part(&target)?;
        // From here on, dropping removes the file.
        let beside = Self {
            target,
            part: Some(part),
        };
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok(beside)
    }

    /// Path to write to.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.part.as_deref().unwrap_or(&self.target)
    }

    /// Gives the written file the target's name.
    ///
    /// # Errors
    /// A file that cannot be synced to disk or renamed; the old file then stays unchanged.
    pub fn finish(mut self) -> io::Result<()> {
        if let Some(part) = &self.part {
            // Otherwise a power cut could leave an empty file under the target's name.
            OpenOptions::new().write(true).open(part)?.sync_all()?;
            fs::rename(part, &self.target)?;
            self.part = None;
        }
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if let Some(part) = &self.part {
            // An error cannot be reported here.
            let _ = fs::remove_file(part);
        }
    }
}

/// The path behind links, for a target that does not exist yet.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    // Limit of links, as in Linux.
    for _ in 0..40 {
        match fs::read_link(&path) {
            // A relative link is relative to the folder of the link.
            Ok(next) => path = path.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many links"))
}

/// A new, empty file in the folder of `target`: rename is atomic only within a folder.
fn part(target: &Path) -> io::Result<(PathBuf, File)> {
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no name of a file"))?;
    // File systems allow 255 bytes per name.
    let name: String = name.to_string_lossy().chars().take(40).collect();
    let mut tries = 0;
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let part = target.with_file_name(format!(".{name}.{}-{count}.part", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&part) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && tries < TRIES => {
                tries += 1;
            }
            opened => return Ok((part, opened?)),
        }
    }
}
