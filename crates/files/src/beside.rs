//! A place beside a file's name, where its successor is written.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Tells the places of one process apart.
static COUNT: AtomicU64 = AtomicU64::new(0);
/// Names tried before giving up; a name can only be taken by what a killed process of the same number left.
const TRIES: usize = 100;

/// A file on its way to its name: [`path`](Self::path) is written, [`finish`](Self::finish) gives it the name.
///
/// Dropped without that, it is removed, and what had the name before is as it was.
#[derive(Debug)]
pub struct Beside {
    target: PathBuf,
    /// `None`: the target is a pipe or a device and is written directly.
    part: Option<PathBuf>,
}

impl Beside {
    /// Makes an empty file beside `target`.
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
                // A rename would pass over the protection.
                OpenOptions::new().write(true).open(named)?;
                (fs::canonicalize(named)?, Some(old.permissions()))
            }
            Err(_) => (behind_links(named)?, None),
        };
        let (part, file) = part(&target)?;
        // From here on dropping removes the file.
        let beside = Self {
            target,
            part: Some(part),
        };
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok(beside)
    }

    /// Where to write.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.part.as_deref().unwrap_or(&self.target)
    }

    /// Gives what was written its name.
    ///
    /// # Errors
    /// A file that cannot be brought to the disk or renamed; the old one is then as it was.
    pub fn finish(mut self) -> io::Result<()> {
        if let Some(part) = &self.part {
            // Else a power cut could leave the new name with nothing in it.
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
            // Nobody is left to be told of a file that cannot be removed.
            let _ = fs::remove_file(part);
        }
    }
}

/// Where a name leads under which nothing is there yet.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    // As many as Linux follows.
    for _ in 0..40 {
        match fs::read_link(&path) {
            // A relative link is relative to the folder of the link.
            Ok(next) => path = path.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many links"))
}

/// A new, empty file in the folder of `target`: only within a folder is a rename one step.
fn part(target: &Path) -> io::Result<(PathBuf, File)> {
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no name of a file"))?;
    // File systems allow 255 bytes a name.
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
