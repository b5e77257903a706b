//! `FileDescriptorSet`: the description of a message and of all messages that it contains.
//!
//! Field numbers of the descriptors are those of `google/protobuf/descriptor.proto`.

use super::{Enum, Field, Kind, Message, find};
use hwall_protobuf::Writer;

const LABEL_OPTIONAL: u64 = 1;
const LABEL_REPEATED: u64 = 3;

/// The description of a message and of every message in it, dependencies first. Every message is a separate file; the result is empty for
/// an unknown name.
pub(crate) fn descriptor_set(name: &str) -> Vec<u8> {
    let mut needed = Vec::new();
    collect(name, &mut needed);
    let mut bytes = Vec::new();
    let mut set = Writer::to_vec(&mut bytes);
    for message in needed {
        set.message(1, |file| write_file(file, message));
    }
    bytes
}

/// Depth first, so that a message comes after its dependencies.
fn collect(name: &str, found: &mut Vec<&'static Message>) {
    let Some(message) = find(name) else { return };
    if found.iter().any(|known| known.name == name) {
        return;
    }
    for field in message.fields {
        if let Kind::Message(inner) = field.kind {
            collect(inner, found);
        }
    }
    found.push(message);
}

/// `foxglove.Log` is in `foxglove/Log.proto`; protobuf's own types are in lower case.
fn file_name(message: &str) -> String {
    match message {
        "google.protobuf.Timestamp" => "google/protobuf/timestamp.proto".to_owned(),
        "google.protobuf.Duration" => "google/protobuf/duration.proto".to_owned(),
        other => format!("{}.proto", other.replace('.', "/")),
    }
}

fn write_file(file: &mut Writer<'_>, message: &Message) {
    let (package, name) = message.name.rsplit_once('.').unwrap_or(("", message.name));
    file.string(1, &file_name(message.name));
    file.string(2, package);
    let mut named: Vec<&str> = Vec::new();
    for field in message.fields {
        if let Kind::Message(inner) = field.kind
            && !named.contains(&inner)
        {
            named.push(inner);
            file.string(3, &file_name(inner));
        }
    }
    file.message(4, |descriptor| {
        descriptor.string(1, name);
        for field in message.fields {
            descriptor.message(2, |f| write_field(f, field));
        }
        for declared in message.enums {
            descriptor.message(4, |e| write_enum(e, declared));
        }
    });
    file.string(12, "proto3");
}

fn write_field(writer: &mut Writer<'_>, field: &Field) {
    writer.string(1, field.name);
    writer.uint64(3, u64::from(field.number));
    let label = if field.repeated {
        LABEL_REPEATED
    } else {
        LABEL_OPTIONAL
    };
    writer.uint64(4, label);
    let (code, type_name) = match field.kind {
        Kind::Double => (1, None),
        Kind::Int64 => (3, None),
        Kind::Uint64 => (4, None),
        Kind::Int32 => (5, None),
        Kind::Fixed32 => (7, None),
        Kind::Bool => (8, None),
        Kind::String => (9, None),
        Kind::Message(name) => (11, Some(name)),
        Kind::Bytes => (12, None),
        Kind::Uint32 => (13, None),
        Kind::Enum(name) => (14, Some(name)),
    };
    writer.uint64(5, code);
    if let Some(name) = type_name {
        // The leading dot starts at the root of all names.
        writer.string(6, &format!(".{name}"));
    }
}

fn write_enum(writer: &mut Writer<'_>, declared: &Enum) {
    writer.string(1, declared.name);
    for (number, value) in declared.values.iter().enumerate() {
        writer.message(2, |v| {
            v.string(1, value);
            v.uint64(2, number as u64);
        });
    }
}
