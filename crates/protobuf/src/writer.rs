//! Writing a message, field by field.

use crate::error::ProtobufError;
use crate::varint;
use crate::wire_type::WireType;

/// Largest field number: 29 bits.
pub(crate) const MAX_FIELD_NUMBER: u32 = (1 << 29) - 1;

/// Destination of the bytes.
#[derive(Debug)]
enum Target<'a> {
    Growing(&'a mut Vec<u8>),
    Slice { bytes: &'a mut [u8], used: usize },
}

/// Writes the fields of a message in the order of the calls.
///
/// Writing to a slice never allocates; a `Vec` grows as usual. An error (no space left, a
/// field number out of range) is kept and returned by [`finish`](Self::finish), so the calls in between need no checks; bytes
/// written after an error are meaningless.
///
/// A nested message is written in place: one byte is reserved for its length, and only a message of more
/// than 127 bytes is moved once to make space for a longer length.
#[derive(Debug)]
pub struct Writer<'a> {
    target: Target<'a>,
    start: usize,
    error: Option<ProtobufError>,
}

impl<'a> Writer<'a> {
    /// Appends to a `Vec`.
    #[must_use]
    pub const fn to_vec(bytes: &'a mut Vec<u8>) -> Self {
        let start = bytes.len();
        Self {
            target: Target::Growing(bytes),
            start,
            error: None,
        }
    }

    /// Writes to the start of a slice.
    #[must_use]
    pub const fn to_slice(bytes: &'a mut [u8]) -> Self {
        Self {
            target: Target::Slice { bytes, used: 0 },
            start: 0,
            error: None,
        }
    }

    /// Returns the number of bytes written.
    ///
    /// # Errors
    /// The first error.
    pub fn finish(self) -> Result<usize, ProtobufError> {
        match self.error {
            Some(error) => Err(error),
            None => Ok(self.used() - self.start),
        }
    }

    /// `uint64`, `uint32`, or an enumeration without negative values.
    pub fn uint64(&mut self, field: u32, value: u64) {
        self.tag(field, WireType::Varint);
        self.varint(value);
    }

    /// `int64`, `int32`, or an enumeration. A negative value takes ten bytes.
    pub fn int64(&mut self, field: u32, value: i64) {
        self.uint64(field, value.cast_unsigned());
    }

    /// `bool`.
    pub fn bool(&mut self, field: u32, value: bool) {
        self.uint64(field, u64::from(value));
    }

    /// `fixed64`.
    pub fn fixed64(&mut self, field: u32, value: u64) {
        self.tag(field, WireType::Fixed64);
        self.append(&value.to_le_bytes());
    }

    /// `fixed32`.
    pub fn fixed32(&mut self, field: u32, value: u32) {
        self.tag(field, WireType::Fixed32);
        self.append(&value.to_le_bytes());
    }

    /// `double`.
    pub fn double(&mut self, field: u32, value: f64) {
        self.fixed64(field, value.to_bits());
    }

    /// `float`.
    pub fn float(&mut self, field: u32, value: f32) {
        self.fixed32(field, value.to_bits());
    }

    /// `bytes`.
    pub fn bytes(&mut self, field: u32, value: &[u8]) {
        self.tag(field, WireType::Bytes);
        self.varint(value.len() as u64);
        self.append(value);
    }

    /// `string`.
    pub fn string(&mut self, field: u32, value: &str) {
        self.bytes(field, value.as_bytes());
    }

    /// `repeated double`, one tag for all. Writes no field for no values.
    pub fn packed_doubles(&mut self, field: u32, values: &[f64]) {
        if values.is_empty() {
            return;
        }
        self.tag(field, WireType::Bytes);
        self.varint(8 * values.len() as u64);
        for value in values {
            self.append(&value.to_le_bytes());
        }
    }

    /// `repeated double`, a tag for each, as proto2 does by default.
    pub fn repeated_doubles(&mut self, field: u32, values: &[f64]) {
        let (tag, length) = varint::encode(u64::from(field) << 3 | 1);
        for &value in values {
            if length == 1 && field != 0 {
                // Write tag and value at once: most fields have small numbers.
                let mut both = [0; 9];
                both[0] = tag[0];
                both[1..].copy_from_slice(&value.to_le_bytes());
                self.append(&both);
            } else {
                self.double(field, value);
            }
        }
    }

    /// `repeated uint64`, `uint32` or an enumeration, one tag for all. Writes no field for no values.
    pub fn packed_varints(&mut self, field: u32, values: &[u64]) {
        if !values.is_empty() {
            self.message(field, |body| {
                for &value in values {
                    body.varint(value);
                }
            });
        }
    }

    /// A nested message; `body` writes its fields. Also used for an element of a repeated field, and for an entry of
    /// a map, whose key is field 1 and whose value is field 2.
    pub fn message(&mut self, field: u32, body: impl FnOnce(&mut Self)) {
        self.tag(field, WireType::Bytes);
        let length_at = self.used();
        self.append(&[0]);
        body(self);
        if self.error.is_some() {
            return;
        }
        let from = length_at + 1;
        let until = self.used();
        let (length, size) = varint::encode((until - from) as u64);
        self.append(&length[1..size]);
        if self.error.is_some() {
            return;
        }
        if let Some(written) = self.written() {
            written.copy_within(from..until, length_at + size);
            written[length_at..length_at + size].copy_from_slice(&length[..size]);
        }
    }

    #[inline]
    fn tag(&mut self, field: u32, wire_type: WireType) {
        if field == 0 || field > MAX_FIELD_NUMBER {
            let offset = self.used() - self.start;
            let number = u64::from(field);
            self.error
                .get_or_insert(ProtobufError::FieldNumber { offset, number });
        }
        self.varint(u64::from(field) << 3 | u64::from(wire_type.code()));
    }

    #[inline]
    fn varint(&mut self, value: u64) {
        let (bytes, length) = varint::encode(value);
        self.append(&bytes[..length]);
    }

    #[inline]
    fn append(&mut self, new: &[u8]) {
        if self.error.is_some() {
            return;
        }
        match &mut self.target {
            Target::Growing(bytes) => bytes.extend_from_slice(new),
            Target::Slice { bytes, used } => {
                let capacity = bytes.len();
                match bytes.get_mut(*used..).and_then(|b| b.get_mut(..new.len())) {
                    Some(free) => {
                        free.copy_from_slice(new);
                        *used += new.len();
                    }
                    None => self.error = Some(ProtobufError::NoSpace { capacity }),
                }
            }
        }
    }

    /// End of the written bytes, from the start of the target.
    const fn used(&self) -> usize {
        match &self.target {
            Target::Growing(bytes) => bytes.len(),
            Target::Slice { used, .. } => *used,
        }
    }

    fn written(&mut self) -> Option<&mut [u8]> {
        match &mut self.target {
            Target::Growing(bytes) => Some(bytes),
            Target::Slice { bytes, used } => bytes.get_mut(..*used),
        }
    }
}
