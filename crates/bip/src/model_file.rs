//! Common format of learned model files: JSON with a header and a digest, and the errors of reading it. Used by [`Model`](crate::Model) and by
//! models of other crates that contain one.
//!
//! A file is one JSON object with the fields `format` (its type), `version` (from 1 up) and `digest`, and the data of the model. The version is
//! checked before the rest is read, because a newer version may differ.
//!
//! ```
//! use hwall_bip::model_file::{self, Digest, Format, ModelFileError};
//!
//! #[derive(serde::Serialize, serde::Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Line { format: String, version: u64, digest: String, slope: f64 }
//!
//! const FORMAT: Format = Format { name: "a line", version: 1 };
//! let digest = |slope| Digest::new().numbers(&[slope]).to_hex();
//! let line = Line {
//!     format: FORMAT.name.to_owned(),
//!     version: FORMAT.version,
//!     digest: digest(0.5),
//!     slope: 0.5,
//! };
//! let text = serde_json::to_string(&line)?;
//!
//! let read: Line = FORMAT.parse(&text)?;
//! model_file::check_digest(&read.digest, digest(read.slope))?;
//! let other = FORMAT.parse::<Line>(r#"{"format": "a plane", "version": 1}"#);
//! assert!(matches!(other, Err(ModelFileError::Format { .. })));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::{self, Read, Write};

/// Errors in a model file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelFileError {
    /// Reading or writing failed.
    #[error("model file: {message}")]
    Io {
        /// Kind of failure.
        kind: io::ErrorKind,
        /// Message of the reader or writer.
        message: String,
    },
    /// The file has another format.
    #[error("the file says it is {found:?}, not {expected:?}")]
    Format {
        /// Expected format name.
        expected: &'static str,
        /// Format name of this file.
        found: String,
    },
    /// The version of the file is unknown.
    #[error("the file has version {found}, the newest known version is {newest}")]
    Version {
        /// Newest version that can be read; the oldest is 1.
        newest: u64,
        /// Version of the file.
        found: u64,
    },
    /// The file is truncated.
    #[error("the file ends too early, at line {line}, column {column}")]
    Truncated {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// The file is not JSON.
    #[error("not JSON at line {line}, column {column}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A field of the file is missing, unknown or of wrong type.
    #[error("not a model at line {line}, column {column}: {problem}")]
    Contents {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field and the problem, as reported by the JSON parser.
        problem: String,
    },
    /// The contents of the file were changed.
    #[error("the file was changed: its contents have digest {computed}, not {stored}")]
    Digest {
        /// Digest in the file.
        stored: String,
        /// Digest of its contents.
        computed: String,
    },
}

/// Header of a type of model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    /// Value of the field `format`.
    pub name: &'static str,
    /// Version written, and the newest version read.
    pub version: u64,
}

impl Format {
    /// Checks the header of a file, then reads all of it. White space does not matter.
    ///
    /// # Errors
    /// Not JSON, another format, version 0 or a newer one, fields that do not fit.
    pub fn parse<T: DeserializeOwned>(&self, text: &str) -> Result<T, ModelFileError> {
        #[derive(Deserialize)]
        struct Header {
            format: String,
            version: u64,
        }
        let header: Header = serde_json::from_str(text)?;
        if header.format != self.name {
            return Err(ModelFileError::Format {
                expected: self.name,
                found: header.format,
            });
        }
        if header.version == 0 || header.version > self.version {
            return Err(ModelFileError::Version {
                newest: self.version,
                found: header.version,
            });
        }
        Ok(serde_json::from_str(text)?)
    }
}

impl From<serde_json::Error> for ModelFileError {
    fn from(e: serde_json::Error) -> Self {
        let (line, column) = (e.line(), e.column());
        match e.classify() {
            serde_json::error::Category::Eof => Self::Truncated { line, column },
            serde_json::error::Category::Data => Self::Contents {
                line,
                column,
                problem: e.to_string(),
            },
            serde_json::error::Category::Syntax | serde_json::error::Category::Io => {
                Self::Syntax { line, column }
            }
        }
    }
}

impl From<io::Error> for ModelFileError {
    fn from(e: io::Error) -> Self {
        Self::Io {
            kind: e.kind(),
            message: e.to_string(),
        }
    }
}

/// Writes the text of a file and flushes the writer.
///
/// # Errors
/// The writer fails.
pub fn write(mut writer: impl Write, text: &str) -> Result<(), ModelFileError> {
    writer.write_all(text.as_bytes())?;
    Ok(writer.flush()?)
}

/// Reads the text of a file to its end.
///
/// # Errors
/// The reader fails, or the text is not UTF-8.
pub fn read(mut reader: impl Read) -> Result<String, ModelFileError> {
    let mut text = String::new();
    reader.read_to_string(&mut text)?;
    Ok(text)
}

/// Compares the digest in a file with that of its contents.
///
/// # Errors
/// They differ.
pub fn check_digest(stored: &str, computed: String) -> Result<(), ModelFileError> {
    if stored == computed {
        return Ok(());
    }
    Err(ModelFileError::Digest {
        stored: stored.to_owned(),
        computed,
    })
}

/// The 64-bit Fowler-Noll-Vo hash, variant 1a: protects against accidents, not forgery.
///
/// It hashes the bits of numbers, not their text, so number formatting does not matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

impl Digest {
    /// Hash of the empty sequence.
    #[must_use]
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        self
    }

    /// Adds a count, as eight bytes, little-endian.
    pub fn count(&mut self, n: usize) -> &mut Self {
        self.bytes(&(n as u64).to_le_bytes())
    }

    /// Adds the count of the numbers, then the bits of each, little-endian.
    pub fn numbers(&mut self, numbers: &[f64]) -> &mut Self {
        self.count(numbers.len());
        for x in numbers {
            self.bytes(&x.to_bits().to_le_bytes());
        }
        self
    }

    /// Adds whether there are numbers (1 or 0), then the numbers.
    pub fn optional(&mut self, numbers: Option<&[f64]>) -> &mut Self {
        self.count(usize::from(numbers.is_some()));
        self.numbers(numbers.unwrap_or_default())
    }

    /// The hash, 16 hexadecimal digits.
    #[must_use]
    pub fn to_hex(&self) -> String {
        format!("{:016x}", self.0)
    }
}
