//! Integers in groups of seven bits, lowest first.

use crate::error::ProtobufError;

/// Length of the longest varint, bytes.
pub(crate) const MAX_LENGTH: usize = 10;

/// The bytes of a value, and its length.
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

/// The value at the start of `bytes`, and its length. `offset`: position of `bytes` in the whole message.
///
/// Redundant leading zeros are accepted, as in protobuf; more than 64 bits are not.
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
        // The tenth byte holds only the 64th bit.
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
