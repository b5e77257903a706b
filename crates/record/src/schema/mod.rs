//! Descriptions of the messages for tools without this crate: protobuf descriptors.

mod descriptor;
mod foxglove;
mod session;

pub(crate) use descriptor::descriptor_set;

/// A message: its full name, the fields, and enumerations declared in it.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) name: &'static str,
    pub(crate) fields: &'static [Field],
    pub(crate) enums: &'static [Enum],
}

/// A field of a message.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) number: u32,
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) repeated: bool,
}

/// An enumeration; values count from zero.
#[derive(Debug)]
pub(crate) struct Enum {
    pub(crate) name: &'static str,
    pub(crate) values: &'static [&'static str],
}

/// The type of a field, with full names.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    Double,
    Int64,
    Uint64,
    Int32,
    Fixed32,
    Bool,
    String,
    Bytes,
    Uint32,
    Message(&'static str),
    Enum(&'static str),
}

const fn field(number: u32, name: &'static str, kind: Kind, repeated: bool) -> Field {
    Field {
        number,
        name,
        kind,
        repeated,
    }
}

const fn one(number: u32, name: &'static str, kind: Kind) -> Field {
    field(number, name, kind, false)
}

const fn many(number: u32, name: &'static str, kind: Kind) -> Field {
    field(number, name, kind, true)
}

/// A message that declares no enumeration.
const fn plain(name: &'static str, fields: &'static [Field]) -> Message {
    Message {
        name,
        fields,
        enums: &[],
    }
}

/// Finds a message in the tables.
fn find(name: &str) -> Option<&'static Message> {
    let mut all = foxglove::MESSAGES.iter().chain(session::MESSAGES);
    all.find(|message| message.name == name)
}
