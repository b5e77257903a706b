//! A message with all kinds of fields, written and read: `cargo run -p hwall-protobuf --example measurement`.

use hwall_protobuf::{Fields, ProtobufError, Writer};

const NAME: u32 = 1;
const TIME: u32 = 2;
const STATE: u32 = 3;
const ANGLES: u32 = 4;
const LABELS: u32 = 5;

/// Seconds and nanoseconds, as most formats have it.
fn time(message: &mut Writer, seconds: u64, nanoseconds: u64) {
    message.uint64(1, seconds);
    message.uint64(2, nanoseconds);
}

fn main() -> Result<(), ProtobufError> {
    let mut bytes = Vec::new();
    let mut writer = Writer::to_vec(&mut bytes);
    writer.string(NAME, "arm");
    writer.message(TIME, |message| time(message, 12, 500_000_000));
    writer.int64(STATE, -1);
    writer.packed_doubles(ANGLES, &[0.5, -0.25]);
    // A map is a repeated message of a key and a value.
    for (key, value) in [("left", 1), ("right", 2)] {
        writer.message(LABELS, |entry| {
            entry.string(1, key);
            entry.uint64(2, value);
        });
    }
    let length = writer.finish()?;
    println!("{length} bytes");

    for field in Fields::new(&bytes) {
        let field = field?;
        match field.number {
            NAME => println!("name {}", field.to_str()?),
            STATE => println!("state {}", field.to_i32()?),
            ANGLES => println!("angles {:?} rad", field.doubles()?.collect::<Vec<_>>()),
            _ => {
                for inner in field.message()? {
                    let inner = inner?;
                    println!("{}.{} {:?}", field.number, inner.number, inner.value);
                }
            }
        }
    }
    Ok(())
}
