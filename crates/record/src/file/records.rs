//! The records of an MCAP file, complete or truncated.

use super::Ending;
use crate::error::RecordError;
use crc::{CRC_32_ISO_HDLC, Crc};
use std::collections::BTreeMap;
use std::ops::Range;

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
const CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0f;
const FOOTER: u8 = 0x02;
/// Bytes of a record before its body: its kind and length.
const FRAMING: usize = 9;
/// Bytes of a message before its data: channel, sequence, two times.
const MESSAGE_HEADER: usize = 22;

/// A message of a wanted channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct MessageAt {
    pub(crate) channel: &'static str,
    /// Byte range of its data in the file.
    pub(crate) data: Range<usize>,
}

/// State of reading the records.
struct Walk<'a, F> {
    bytes: &'a [u8],
    /// Names of the wanted channels.
    wanted: &'a [&'static str],
    channels: BTreeMap<u16, &'static str>,
    found: F,
}

/// Calls `found` for every message of the `wanted` channels, in the order of the file.
pub(crate) fn read_messages(
    bytes: &[u8],
    wanted: &[&'static str],
    found: impl FnMut(MessageAt),
) -> Result<Ending, RecordError> {
    if !bytes.starts_with(&MAGIC) {
        return Err(RecordError::NotMcap);
    }
    let mut walk = Walk {
        bytes,
        wanted,
        channels: BTreeMap::new(),
        found,
    };
    walk.records(MAGIC.len()..bytes.len(), true)
}

/// Reads a body from front to back.
struct Cursor<'a> {
    rest: &'a [u8],
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }
}

/// The body of a record, or what is left of a truncated one.
type Body<'a> = Result<&'a [u8], &'a [u8]>;

/// Kind and body of a record.
fn framed(rest: &[u8]) -> Option<(u8, Body<'_>)> {
    let mut framing = Cursor { rest };
    let ([op], length) = (framing.array()?, framing.u64()?);
    let whole = usize::try_from(length).ok().and_then(|n| framing.take(n));
    Some((op, whole.ok_or(framing.rest)))
}

impl<F: FnMut(MessageAt)> Walk<'_, F> {
    /// Reads the records of a part of the file; `top` is true outside chunks.
    fn records(&mut self, part: Range<usize>, top: bool) -> Result<Ending, RecordError> {
        let bytes = self.bytes;
        let mut at = part.start;
        while let Some(rest) = bytes.get(at..part.end).filter(|rest| !rest.is_empty()) {
            let cut = Ending::Cut { offset: at as u64 };
            let start = at + FRAMING;
            let (op, body) = match framed(rest) {
                Some((op, Ok(body))) => (op, body),
                // The complete messages of a truncated chunk are usable.
                Some((CHUNK, Err(left))) if top => {
                    self.cut_chunk(start, left)?;
                    return Ok(cut);
                }
                _ => return Ok(cut),
            };
            match op {
                CHANNEL => self.channel(at, body)?,
                MESSAGE => self.message(at, start, body)?,
                CHUNK if top => self.chunk(at, start, body)?,
                DATA_END if top => return Ok(self.end(start + body.len())),
                _ => {}
            }
            at = start + body.len();
        }
        Ok(Ending::Cut { offset: at as u64 })
    }

    /// Skips the summary, the footer and the magic after the data; the file should end there.
    fn end(&self, mut at: usize) -> Ending {
        loop {
            let rest = self.bytes.get(at..).unwrap_or_default();
            let Some((op, Ok(body))) = framed(rest) else {
                return Ending::Cut { offset: at as u64 };
            };
            at += FRAMING + body.len();
            if op == FOOTER {
                let end = at + MAGIC.len();
                return match self.bytes.get(end..) {
                    None => Ending::Cut { offset: at as u64 },
                    Some([]) => Ending::Unfinished,
                    Some(_) => Ending::Followed { offset: end as u64 },
                };
            }
        }
    }

    fn channel(&mut self, at: usize, body: &[u8]) -> Result<(), RecordError> {
        let mut cursor = Cursor { rest: body };
        let mut read = || {
            let (id, _schema) = (cursor.u16()?, cursor.u16()?);
            Some((id, cursor.text()?))
        };
        let (id, topic) = read().ok_or(RecordError::BadRecord {
            offset: at as u64,
            kind: "channel",
            missing: "id and topic",
        })?;
        if let Some(name) = self.wanted.iter().find(|name| **name == topic) {
            self.channels.insert(id, name);
        } else {
            self.channels.remove(&id);
        }
        Ok(())
    }

    fn message(&mut self, at: usize, start: usize, body: &[u8]) -> Result<(), RecordError> {
        let mut cursor = Cursor { rest: body };
        let (Some(id), true) = (cursor.u16(), body.len() >= MESSAGE_HEADER) else {
            return Err(RecordError::BadRecord {
                offset: at as u64,
                kind: "message",
                missing: "channel, sequence and times",
            });
        };
        if let Some(channel) = self.channels.get(&id) {
            (self.found)(MessageAt {
                channel,
                data: start + MESSAGE_HEADER..start + body.len(),
            });
        }
        Ok(())
    }

    fn chunk(&mut self, at: usize, start: usize, body: &[u8]) -> Result<(), RecordError> {
        let offset = at as u64;
        let missing = RecordError::BadRecord {
            offset,
            kind: "chunk",
            missing: "its header or all its records",
        };
        let Some(header) = ChunkHeader::read(body) else {
            return Err(missing);
        };
        if !header.compression.is_empty() {
            return Err(RecordError::Compressed {
                offset,
                compression: header.compression.to_owned(),
            });
        }
        let records = usize::try_from(header.length)
            .ok()
            .and_then(|length| body.get(header.size..)?.get(..length));
        let Some(records) = records else {
            return Err(missing);
        };
        let found = CHECKSUM.checksum(records);
        // Zero means that no checksum was computed.
        if header.checksum != 0 && header.checksum != found {
            return Err(RecordError::Checksum {
                offset,
                expected: header.checksum,
                found,
            });
        }
        let first = start + header.size;
        match self.records(first..first + records.len(), false)? {
            Ending::Cut { offset } if offset == (first + records.len()) as u64 => Ok(()),
            _ => Err(missing),
        }
    }

    fn cut_chunk(&mut self, start: usize, body: &[u8]) -> Result<(), RecordError> {
        if let Some(header) = ChunkHeader::read(body)
            && header.compression.is_empty()
        {
            self.records(start + header.size..start + body.len(), false)?;
        }
        Ok(())
    }
}

struct ChunkHeader<'a> {
    checksum: u32,
    compression: &'a str,
    /// Length of the records, bytes.
    length: u64,
    /// Size of the header itself, bytes.
    size: usize,
}

impl<'a> ChunkHeader<'a> {
    fn read(body: &'a [u8]) -> Option<Self> {
        let mut cursor = Cursor { rest: body };
        let (_first_ns, _last_ns, _uncompressed) = (cursor.u64()?, cursor.u64()?, cursor.u64()?);
        let checksum = cursor.u32()?;
        let compression = cursor.text()?;
        let length = cursor.u64()?;
        Some(Self {
            checksum,
            compression,
            length,
            size: body.len() - cursor.rest.len(),
        })
    }
}
