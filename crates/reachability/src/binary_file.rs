//! Binary files with one body: versioned, checksummed, the same bytes on every machine.
//!
//! Layout: 8 bytes for the file type, format (u16), length of the body (u64), the body (postcard), CRC-32 of
//! everything before it (u32); integers little-endian. Nothing is rounded.

use serde::Serialize;
use serde::de::DeserializeOwned;

const HEADER: usize = 8 + 2 + 8;
const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// A file type and its latest known format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BinaryFormat {
    /// First bytes of the file.
    pub magic: [u8; 8],
    /// Format number, from 1: files are written in this format and read in this and earlier ones.
    pub format: u16,
}

/// Why bytes are not a valid file of a type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BinaryFileError {
    /// Another file type.
    #[error("the file does not begin as one of its kind")]
    Foreign,
    /// Written by a later version.
    #[error("format {found}, formats up to {known} are known")]
    Newer {
        /// Format of the file.
        found: u16,
        /// The latest that is known.
        known: u16,
    },
    /// The file is too short or too long.
    #[error("{found} bytes where the header promises {expected}")]
    WrongLength {
        /// Length according to the header, bytes.
        expected: u64,
        /// Actual length, bytes.
        found: u64,
    },
    /// The checksum does not match: some bytes have changed.
    #[error("checksum {found:08x} instead of {expected:08x}")]
    Damaged {
        /// Checksum in the file.
        expected: u32,
        /// Checksum computed from the file's bytes.
        found: u32,
    },
    /// The bytes are intact, but their content is invalid.
    #[error("malformed: {what}")]
    Malformed {
        /// The invalid part.
        what: &'static str,
    },
}

impl BinaryFormat {
    /// Serializes a body. It may contain only plain numbers and lists of known length, which always serialize.
    #[must_use]
    pub fn to_bytes(&self, body: &impl Serialize) -> Vec<u8> {
        // Serializing such a body cannot fail.
        let body = postcard::to_stdvec(body).unwrap_or_default();
        let mut bytes = Vec::with_capacity(HEADER + body.len() + 4);
        bytes.extend_from_slice(&self.magic);
        bytes.extend_from_slice(&self.format.to_le_bytes());
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&body);
        let checksum = CHECKSUM.checksum(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// The body of bytes written by [`to_bytes`](Self::to_bytes). Does not check the values.
    ///
    /// # Errors
    /// Foreign, newer, truncated, damaged or malformed bytes: each has its own variant.
    pub fn from_bytes<T: DeserializeOwned>(&self, bytes: &[u8]) -> Result<T, BinaryFileError> {
        let malformed = |what| BinaryFileError::Malformed { what };
        let body = self.checked_body(bytes)?;
        let (body, rest) = postcard::take_from_bytes(body).map_err(|_| malformed("body"))?;
        if !rest.is_empty() {
            return Err(malformed("bytes behind the body"));
        }
        Ok(body)
    }

    /// The body, after checking header and checksum.
    fn checked_body<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], BinaryFileError> {
        let number = |at: usize, count: usize| {
            let mut value = [0; 8];
            value[..count].copy_from_slice(bytes.get(at..at + count)?);
            Some(u64::from_le_bytes(value))
        };
        if !bytes.starts_with(&self.magic) {
            return Err(BinaryFileError::Foreign);
        }
        let too_short = BinaryFileError::WrongLength {
            expected: (HEADER + 4) as u64,
            found: bytes.len() as u64,
        };
        let (Some(format), Some(length)) = (number(8, 2), number(10, 8)) else {
            return Err(too_short);
        };
        if format == 0 {
            return Err(BinaryFileError::Malformed { what: "format 0" });
        }
        if format > u64::from(self.format) {
            return Err(BinaryFileError::Newer {
                found: format as u16,
                known: self.format,
            });
        }
        let expected = length.saturating_add(HEADER as u64 + 4);
        if bytes.len() as u64 != expected {
            return Err(BinaryFileError::WrongLength {
                expected,
                found: bytes.len() as u64,
            });
        }
        let end = bytes.len() - 4;
        let stored = number(end, 4).ok_or(too_short)? as u32;
        let found = CHECKSUM.checksum(&bytes[..end]);
        if found != stored {
            return Err(BinaryFileError::Damaged {
                expected: stored,
                found,
            });
        }
        Ok(&bytes[HEADER..end])
    }
}
