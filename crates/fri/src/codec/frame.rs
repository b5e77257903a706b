//! The frame of 2.7: a length before the message, a checksum after it.

use crate::error::FriError;
use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// Size of the length field before the message, bytes.
pub(super) const LENGTH_BYTES: usize = 4;
/// Size of length and checksum, bytes.
pub(super) const FRAME_BYTES: usize = LENGTH_BYTES + 4;

/// The zlib polynomial, sixteen bytes at a time: byte by byte it would take longer than everything else.
const CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// Writes length and checksum around a message that begins at byte 4; returns the size of the datagram.
pub(super) fn close(buffer: &mut [u8], message_bytes: usize) -> Result<usize, FriError> {
    let total = message_bytes + FRAME_BYTES;
    let capacity = buffer.len();
    let no_space = FriError::Wire(hwall_protobuf::ProtobufError::NoSpace { capacity });
    let datagram = buffer.get_mut(..total).ok_or(no_space)?;
    let (length, rest) = datagram.split_at_mut(LENGTH_BYTES);
    let (message, checksum) = rest.split_at_mut(message_bytes);
    length.copy_from_slice(&(message_bytes as u32).to_le_bytes());
    checksum.copy_from_slice(&CRC.checksum(message).to_le_bytes());
    Ok(total)
}

/// The message in a datagram. Bytes after the checksum are ignored.
pub(super) fn open(datagram: &[u8]) -> Result<&[u8], FriError> {
    let too_short = || FriError::FrameTooShort {
        found: datagram.len(),
    };
    let (length, rest) = datagram.split_first_chunk().ok_or_else(too_short)?;
    let stated = u32::from_le_bytes(*length) as usize;
    let wrong_length = || FriError::FrameLength {
        stated,
        found: rest.len().saturating_sub(4),
    };
    let (message, rest) = rest.split_at_checked(stated).ok_or_else(wrong_length)?;
    let (checksum, _) = rest.split_first_chunk().ok_or_else(wrong_length)?;
    let (stated, found) = (u32::from_le_bytes(*checksum), CRC.checksum(message));
    match stated == found {
        true => Ok(message),
        false => Err(FriError::Checksum { stated, found }),
    }
}
