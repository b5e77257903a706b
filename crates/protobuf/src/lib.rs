#![doc = include_str!("../README.md")]

mod error;
mod fields;
mod varint;
mod wire_type;
mod writer;

pub use error::ProtobufError;
pub use fields::{Doubles, Field, Fields, Value, Varints};
pub use wire_type::WireType;
pub use writer::Writer;
