//! The one error type of the crate.

use crate::wire_type::WireType;

/// What is wrong with bytes that were read, or with a message that was written.
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
        /// Bytes that it needs; for a varint one more than there are.
        needed: usize,
        /// Bytes that are left there.
        left: usize,
    },
    /// A varint of more than 64 bits.
    #[error("byte {offset}: a varint of more than 64 bits")]
    VarintTooLong {
        /// Where the varint begins.
        offset: usize,
    },
    /// A field number that protobuf does not have.
    #[error("byte {offset}: {number} is no field number")]
    FieldNumber {
        /// Where the tag begins.
        offset: usize,
        /// The number.
        number: u64,
    },
    /// A wire type that protobuf does not have.
    #[error("byte {offset}: {code} is no wire type")]
    UnknownWireType {
        /// Where the tag begins.
        offset: usize,
        /// The three bits of the tag.
        code: u8,
    },
    /// The end of a group that was not begun.
    #[error("byte {offset}: the end of group {number}, which did not begin")]
    GroupEnd {
        /// Where the tag begins.
        offset: usize,
        /// Field number of the group.
        number: u32,
    },
    /// Groups within groups, deeper than anybody writes them.
    #[error("byte {offset}: groups nested deeper than {limit}")]
    GroupDepth {
        /// Where the innermost group begins.
        offset: usize,
        /// The depth that is read.
        limit: usize,
    },
    /// The field is there, but of another wire type than asked for.
    #[error("byte {offset}: field {number} is {found}, not {expected}")]
    WrongWireType {
        /// Where the value begins.
        offset: usize,
        /// Field number.
        number: u32,
        /// What was asked for.
        expected: WireType,
        /// What is there.
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
        /// The type asked for.
        kind: &'static str,
    },
    /// A string that is not UTF-8.
    #[error("byte {offset}: field {number} is not UTF-8")]
    NotUtf8 {
        /// Where the first wrong byte is.
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
        /// Bytes there are.
        length: usize,
        /// Bytes of one value.
        size: usize,
    },
    /// The message does not fit into the slice that it is written to.
    #[error("the message does not fit into {capacity} bytes")]
    NoSpace {
        /// Bytes of the slice.
        capacity: usize,
    },
}
