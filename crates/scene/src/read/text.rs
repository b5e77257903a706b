//! Reading of text files within limits.

use crate::error::{Result, SceneError, at_most};
use std::io::Read as _;
use std::path::Path;

/// Limits of files to read. The defaults need at most about two gigabytes of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of the OBJ, of its sidecar and of each material library; default 256 MiB.
    pub max_bytes: u64,
    /// Triangles after triangulation; default four million.
    pub max_triangles: u64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            max_bytes: 256 << 20,
            max_triangles: 4_000_000,
        }
    }
}

/// Reads a text file of a scene, without a byte order mark. Text that is not UTF-8 is read as Latin-1.
///
/// # Errors
/// A file that cannot be read, is larger than the limit, or is neither UTF-8 nor free of control bytes; the error
/// names the file.
pub fn read_text(path: &Path, limits: &LoadLimits) -> Result<String> {
    let io = |e: std::io::Error| SceneError::Io {
        path: path.display().to_string(),
        kind: e.kind(),
        message: e.to_string(),
    };
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(limits.max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(io)?;
    at_most(limits.max_bytes, "bytes", bytes.len() as u64).map_err(|error| error.in_file(path))?;
    let latin = |bytes: Vec<u8>| {
        let is_binary = |byte: &u8| *byte < 0x20 && !byte.is_ascii_whitespace();
        match bytes.iter().position(is_binary) {
            Some(offset) => Err(SceneError::NotText { offset }.in_file(path)),
            None => Ok(bytes.into_iter().map(char::from).collect()),
        }
    };
    let mut text = String::from_utf8(bytes).or_else(|error| latin(error.into_bytes()))?;
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len_utf8());
    }
    Ok(text)
}

/// Windows puts it before text in UTF-8.
pub(super) const BYTE_ORDER_MARK: char = '\u{feff}';
