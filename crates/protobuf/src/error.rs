//! The one error type of the crate.

use crate::wire_type::WireType;

/// An error in bytes read or in a message written.
///
/// Offsets count bytes from the start of the outermost message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProtobufError {
    /// The bytes end within a value.
    #[error("byte {offset}: {needed} bytes needed, {left} left")]
    Truncated {
        /// Where the value begins.
        offset: usize,
        /// Bytes needed; for a varint one more than there are.
        needed: usize,
        /// Bytes left.
        left: usize,
    },
    /// A varint of more than 64 bits.
    #[error("byte {offset}: a varint of more than 64 bits")]
    VarintTooLong {
        /// Where the varint begins.
        offset: usize,
    },
    /// An invalid field number.
    #[error("byte {offset}: {number} is no field number")]
    FieldNumber {
        /// Where the tag begins.
        offset: usize,
        /// The number.
        number: u64,
    },
    /// An invalid wire type.
    #[error("byte {offset}: {code} is no wire type")]
    UnknownWireType {
        /// Where the tag begins.
        offset: usize,
        /// The three bits of the tag.
        code: u8,
    },
    /// The end of a group that was not started.
    #[error("byte {offset}: the end of group {number}, which did not begin")]
    GroupEnd {
        /// Where the tag begins.
        offset: usize,
        /// Field number of the group.
        number: u32,
    },
    /// Groups nested deeper than the limit.
    #[error("byte {offset}: groups nested deeper than {limit}")]
    GroupDepth {
        /// Where the innermost group begins.
        offset: usize,
        /// The limit.
        limit: usize,
    },
    /// The field has another wire type than requested.
    #[error("byte {offset}: field {number} is {found}, not {expected}")]
    WrongWireType {
        /// Where the value begins.
        offset: usize,
        /// Field number.
        number: u32,
        /// The requested type.
        expected: WireType,
        /// The type found.
        found: WireType,
    },
    /// An integer outside the range of its type.
    #[error("byte {offset}: field {number} is {value}, which {kind} does not hold")]
    IntegerRange {
        /// Where the value begins.
        offset: usize,
        /// Field number.
        number: u32,
        /// The varint, as 64 bits.
        value: u64,
        /// The requested type.
        kind: &'static str,
    },
    /// A string that is not UTF-8.
    #[error("byte {offset}: field {number} is not UTF-8")]
    NotUtf8 {
        /// Offset of the first wrong byte.
        offset: usize,
        /// Field number.
        number: u32,
    },
    /// Packed values whose bytes are not a multiple of the size of one.
    #[error("byte {offset}: {length} bytes of field {number} are no multiple of {size}")]
    PackedLength {
        /// Where the values begin.
        offset: usize,
        /// Field number.
        number: u32,
        /// Number of bytes.
        length: usize,
        /// Bytes of one value.
        size: usize,
    },
    /// The message does not fit into the output slice.
    #[error("the message does not fit into {capacity} bytes")]
    NoSpace {
        /// Bytes of the slice.
        capacity: usize,
    },
}
