//! Integers in groups of seven bits, lowest first.

use crate::error::ProtobufError;

/// Bytes that the longest varint takes.
pub(crate) const MAX_LENGTH: usize = 10;

/// The bytes of a value, and how many of them count.
#[inline]
pub(crate) const fn encode(mut value: u64) -> ([u8; MAX_LENGTH], usize) {
    let mut bytes = [0; MAX_LENGTH];
    let mut length = 0;
    while value >= 0x80 {
        bytes[length] = (value & 0x7f) as u8 | 0x80;
        value >>= 7;
        length += 1;
    }
    bytes[length] = value as u8;
    (bytes, length + 1)
}

/// The value at the start of `bytes` and how many bytes it takes. `offset` is where they lie in the whole message.
///
/// Zeros in front are accepted, as protobuf does; more than 64 bits are not.
#[inline]
pub(crate) fn decode(bytes: &[u8], offset: usize) -> Result<(u64, usize), ProtobufError> {
    match bytes.first() {
        Some(&byte) if byte < 0x80 => Ok((u64::from(byte), 1)),
        _ => decode_long(bytes, offset),
    }
}

fn decode_long(bytes: &[u8], offset: usize) -> Result<(u64, usize), ProtobufError> {
    let mut value = 0;
    for (index, &byte) in bytes.iter().enumerate().take(MAX_LENGTH) {
        let bits = u64::from(byte & 0x7f);
        // The tenth byte holds the 64th bit and no other.
        if index + 1 == MAX_LENGTH && byte > 1 {
            return Err(ProtobufError::VarintTooLong { offset });
        }
        value |= bits << (7 * index);
        if byte < 0x80 {
            return Ok((value, index + 1));
        }
    }
    Err(ProtobufError::Truncated {
        offset,
        needed: bytes.len() + 1,
        left: bytes.len(),
    })
}
