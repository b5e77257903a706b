//! The kinds of values on the wire.

use std::fmt;

/// Encoding of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireType {
    /// Integers, booleans, enumerations.
    Varint,
    /// Eight bytes: double, fixed64.
    Fixed64,
    /// A length and as many bytes: strings, bytes, messages, packed values.
    Bytes,
    /// A group, which proto3 no longer has.
    Group,
    /// Four bytes: float, fixed32.
    Fixed32,
}

impl WireType {
    /// The three bits in the tag; for a group, those of its start.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Varint => 0,
            Self::Fixed64 => 1,
            Self::Bytes => 2,
            Self::Group => 3,
            Self::Fixed32 => 5,
        }
    }
}

impl fmt::Display for WireType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Varint => "a varint",
            Self::Fixed64 => "eight bytes",
            Self::Bytes => "a length and bytes",
            Self::Group => "a group",
            Self::Fixed32 => "four bytes",
        })
    }
}
