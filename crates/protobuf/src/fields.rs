//! Reading a message, field by field.

use crate::error::ProtobufError;
use crate::varint;
use crate::wire_type::WireType;
use crate::writer::MAX_FIELD_NUMBER;

/// Largest nesting depth of groups to skip.
const GROUP_DEPTH: usize = 16;
/// Wire type of the end of a group.
const GROUP_END: u8 = 4;

/// The fields of a message, in byte order: an iterator that accepts any bytes.
///
/// Ends after an error. Groups are skipped; the caller skips unknown fields by ignoring them.
/// Copies and allocates nothing.
#[derive(Debug, Clone)]
pub struct Fields<'a> {
    bytes: &'a [u8],
    /// Where `bytes` begin in the outermost message.
    offset: usize,
}

/// One field of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    /// Its number, 1 to 2²⁹ - 1.
    pub number: u32,
    /// Its value.
    pub value: Value<'a>,
    /// Where the value begins in the outermost message (for bytes: after their length).
    pub offset: usize,
}

/// A raw value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// Integers, booleans, enumerations.
    Varint(u64),
    /// Eight bytes, little-endian.
    Fixed64(u64),
    /// Four bytes, little-endian.
    Fixed32(u32),
    /// Strings, bytes, messages, packed values.
    Bytes(&'a [u8]),
}

impl Value<'_> {
    /// The wire type.
    #[must_use]
    pub const fn wire_type(&self) -> WireType {
        match self {
            Self::Varint(_) => WireType::Varint,
            Self::Fixed64(_) => WireType::Fixed64,
            Self::Fixed32(_) => WireType::Fixed32,
            Self::Bytes(_) => WireType::Bytes,
        }
    }
}

impl<'a> Fields<'a> {
    /// The fields of the message that fills `bytes`.
    #[must_use]
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0 }
    }

    #[inline]
    fn advance(&mut self, count: usize) -> Result<&'a [u8], ProtobufError> {
        match self.bytes.split_at_checked(count) {
            Some((taken, rest)) => {
                self.bytes = rest;
                self.offset += count;
                Ok(taken)
            }
            None => Err(ProtobufError::Truncated {
                offset: self.offset,
                needed: count,
                left: self.bytes.len(),
            }),
        }
    }

    #[inline]
    fn varint(&mut self) -> Result<u64, ProtobufError> {
        let (value, length) = varint::decode(self.bytes, self.offset)?;
        self.advance(length)?;
        Ok(value)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ProtobufError> {
        let mut array = [0; N];
        array.copy_from_slice(self.advance(N)?);
        Ok(array)
    }

    /// Field number and the three bits of the wire type.
    #[inline]
    fn tag(&mut self) -> Result<(u32, u8), ProtobufError> {
        let offset = self.offset;
        let tag = self.varint()?;
        let number = tag >> 3;
        match u32::try_from(number) {
            Ok(n) if n != 0 && n <= MAX_FIELD_NUMBER => Ok((n, (tag & 7) as u8)),
            _ => Err(ProtobufError::FieldNumber { offset, number }),
        }
    }

    /// The value of a wire type; `None` for the bounds of a group.
    #[inline]
    fn value(&mut self, code: u8) -> Result<Option<(usize, Value<'a>)>, ProtobufError> {
        let mut offset = self.offset;
        let value = match code {
            0 => Value::Varint(self.varint()?),
            1 => Value::Fixed64(u64::from_le_bytes(self.array()?)),
            2 => {
                let length = self.varint()?;
                offset = self.offset;
                // A length beyond `usize` is also beyond the bytes.
                let length = usize::try_from(length).unwrap_or(usize::MAX);
                Value::Bytes(self.advance(length)?)
            }
            5 => Value::Fixed32(u32::from_le_bytes(self.array()?)),
            _ => return Ok(None),
        };
        Ok(Some((offset, value)))
    }

    /// Skips to the end of a group that has just begun.
    fn skip_group(&mut self, number: u32) -> Result<(), ProtobufError> {
        let mut open = [0; GROUP_DEPTH];
        open[0] = number;
        let mut depth = 1;
        while depth > 0 {
            let offset = self.offset;
            let (number, code) = self.tag()?;
            match code {
                3 if depth < GROUP_DEPTH => {
                    open[depth] = number;
                    depth += 1;
                }
                3 => {
                    let limit = GROUP_DEPTH;
                    return Err(ProtobufError::GroupDepth { offset, limit });
                }
                GROUP_END if open[depth - 1] == number => depth -= 1,
                GROUP_END => return Err(ProtobufError::GroupEnd { offset, number }),
                _ if self.value(code)?.is_some() => {}
                _ => return Err(ProtobufError::UnknownWireType { offset, code }),
            }
        }
        Ok(())
    }

    #[inline]
    fn read(&mut self) -> Result<Option<Field<'a>>, ProtobufError> {
        while !self.bytes.is_empty() {
            let offset = self.offset;
            let (number, code) = self.tag()?;
            match (code, self.value(code)?) {
                (_, Some((offset, value))) => {
                    return Ok(Some(Field {
                        number,
                        value,
                        offset,
                    }));
                }
                (3, None) => self.skip_group(number)?,
                (GROUP_END, None) => return Err(ProtobufError::GroupEnd { offset, number }),
                (code, None) => return Err(ProtobufError::UnknownWireType { offset, code }),
            }
        }
        Ok(None)
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<Field<'a>, ProtobufError>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let read = self.read();
        if read.is_err() {
            self.bytes = &[];
        }
        read.transpose()
    }
}

impl std::iter::FusedIterator for Fields<'_> {}

impl<'a> Field<'a> {
    /// `uint64`.
    ///
    /// # Errors
    /// Another wire type.
    #[inline]
    pub const fn to_u64(&self) -> Result<u64, ProtobufError> {
        match self.value {
            Value::Varint(value) => Ok(value),
            _ => Err(self.wrong(WireType::Varint)),
        }
    }

    /// `uint32`.
    ///
    /// # Errors
    /// Another wire type, or a value of more than 32 bits.
    #[inline]
    pub fn to_u32(&self) -> Result<u32, ProtobufError> {
        let value = self.to_u64()?;
        u32::try_from(value).map_err(|_| self.out_of_range(value, "uint32"))
    }

    /// `int32` or an enumeration. A negative value may have 64 bits, as protobuf writes it, or 32.
    ///
    /// # Errors
    /// Another wire type, or a value outside the range.
    #[inline]
    pub fn to_i32(&self) -> Result<i32, ProtobufError> {
        let value = self.to_u64()?;
        if let Ok(value) = u32::try_from(value) {
            return Ok(value.cast_signed());
        }
        i32::try_from(value.cast_signed()).map_err(|_| self.out_of_range(value, "int32"))
    }

    /// `double`.
    ///
    /// # Errors
    /// Another wire type.
    #[inline]
    pub const fn to_f64(&self) -> Result<f64, ProtobufError> {
        match self.value {
            Value::Fixed64(bits) => Ok(f64::from_bits(bits)),
            _ => Err(self.wrong(WireType::Fixed64)),
        }
    }

    /// `float`.
    ///
    /// # Errors
    /// Another wire type.
    pub const fn to_f32(&self) -> Result<f32, ProtobufError> {
        match self.value {
            Value::Fixed32(bits) => Ok(f32::from_bits(bits)),
            _ => Err(self.wrong(WireType::Fixed32)),
        }
    }

    /// `bytes`.
    ///
    /// # Errors
    /// Another wire type.
    #[inline]
    pub const fn to_bytes(&self) -> Result<&'a [u8], ProtobufError> {
        match self.value {
            Value::Bytes(bytes) => Ok(bytes),
            _ => Err(self.wrong(WireType::Bytes)),
        }
    }

    /// `string`.
    ///
    /// # Errors
    /// Another wire type, or bytes that are not UTF-8.
    pub fn to_str(&self) -> Result<&'a str, ProtobufError> {
        std::str::from_utf8(self.to_bytes()?).map_err(|error| ProtobufError::NotUtf8 {
            offset: self.offset + error.valid_up_to(),
            number: self.number,
        })
    }

    /// The fields of a nested message.
    ///
    /// # Errors
    /// Another wire type. The iterator reports errors inside.
    #[inline]
    pub fn message(&self) -> Result<Fields<'a>, ProtobufError> {
        Ok(Fields {
            bytes: self.to_bytes()?,
            offset: self.offset,
        })
    }

    /// The values that this field adds to a `repeated double`: one, or all packed ones.
    ///
    /// # Errors
    /// Another wire type, or packed bytes whose length is not a multiple of eight.
    pub fn doubles(&self) -> Result<Doubles<'a>, ProtobufError> {
        let (one, packed): (_, &[u8]) = match self.value {
            Value::Fixed64(bits) => (Some(f64::from_bits(bits)), &[]),
            Value::Bytes(bytes) => (None, bytes),
            _ => return Err(self.wrong(WireType::Fixed64)),
        };
        let (values, rest) = packed.as_chunks();
        if !rest.is_empty() {
            return Err(ProtobufError::PackedLength {
                offset: self.offset,
                number: self.number,
                length: packed.len(),
                size: 8,
            });
        }
        Ok(Doubles { one, values })
    }

    /// The values that this field adds to a repeated integer or enumeration: one, or all packed ones.
    ///
    /// # Errors
    /// Another wire type. The iterator reports errors inside.
    pub const fn varints(&self) -> Result<Varints<'a>, ProtobufError> {
        let (one, packed): (_, &[u8]) = match self.value {
            Value::Varint(value) => (Some(value), &[]),
            Value::Bytes(bytes) => (None, bytes),
            _ => return Err(self.wrong(WireType::Varint)),
        };
        let packed = Fields {
            bytes: packed,
            offset: self.offset,
        };
        Ok(Varints { one, packed })
    }

    const fn wrong(&self, expected: WireType) -> ProtobufError {
        ProtobufError::WrongWireType {
            offset: self.offset,
            number: self.number,
            expected,
            found: self.value.wire_type(),
        }
    }

    const fn out_of_range(&self, value: u64, kind: &'static str) -> ProtobufError {
        ProtobufError::IntegerRange {
            offset: self.offset,
            number: self.number,
            value,
            kind,
        }
    }
}

/// Doubles of one field; see [`Field::doubles`].
#[derive(Debug, Clone)]
pub struct Doubles<'a> {
    one: Option<f64>,
    values: &'a [[u8; 8]],
}

impl Iterator for Doubles<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        self.one.take().or_else(|| {
            let (first, rest) = self.values.split_first()?;
            self.values = rest;
            Some(f64::from_le_bytes(*first))
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.values.len() + usize::from(self.one.is_some());
        (left, Some(left))
    }
}

impl ExactSizeIterator for Doubles<'_> {}

/// Integers of one field; see [`Field::varints`]. Ends after an error.
#[derive(Debug, Clone)]
pub struct Varints<'a> {
    one: Option<u64>,
    packed: Fields<'a>,
}

impl Iterator for Varints<'_> {
    type Item = Result<u64, ProtobufError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(one) = self.one.take() {
            return Some(Ok(one));
        }
        if self.packed.bytes.is_empty() {
            return None;
        }
        let value = self.packed.varint();
        if value.is_err() {
            self.packed.bytes = &[];
        }
        Some(value)
    }
}
