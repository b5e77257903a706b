//! Known bytes, round trips, broken bytes.

use hwall_protobuf::{Field, Fields, ProtobufError, Value, WireType, Writer};
use hwall_testkit::Sampler;

fn written(body: impl FnOnce(&mut Writer)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = Writer::to_vec(&mut bytes);
    body(&mut writer);
    let length = writer.finish().expect("a message");
    assert_eq!(length, bytes.len());
    bytes
}

fn only(bytes: &[u8]) -> Field<'_> {
    let mut fields = Fields::new(bytes);
    let field = fields.next().expect("a field").expect("a valid one");
    assert!(fields.next().is_none());
    field
}

fn error(bytes: &[u8]) -> ProtobufError {
    let mut fields = Fields::new(bytes);
    let error = fields.find_map(Result::err).expect("an error");
    assert!(fields.next().is_none(), "fields after an error");
    error
}

/// Examples from the public description of the encoding.
#[test]
fn known_bytes() {
    assert_eq!(written(|w| w.uint64(1, 150)), [0x08, 0x96, 0x01]);
    let testing = [0x12, 7, 0x74, 0x65, 0x73, 0x74, 0x69, 0x6e, 0x67];
    assert_eq!(written(|w| w.string(2, "testing")), testing);
    let nested = written(|w| w.message(3, |m| m.uint64(1, 150)));
    assert_eq!(nested, [0x1a, 3, 0x08, 0x96, 0x01]);
    let packed = written(|w| w.packed_varints(6, &[3, 270, 86942]));
    assert_eq!(packed, [0x32, 6, 3, 0x8e, 2, 0x9e, 0xa7, 5]);
    let one = written(|w| w.double(1, 1.0));
    assert_eq!(one, [0x09, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    let minus_two = written(|w| w.int64(1, -2));
    assert_eq!(minus_two[..2], [0x08, 0xfe]);
    assert_eq!(minus_two[2..], [255, 255, 255, 255, 255, 255, 255, 255, 1]);
}

#[test]
fn integers_come_back() {
    let edges = [0, 1, -1, 2, 63, 64, 127, 128, 300, i64::MAX, i64::MIN];
    for value in edges {
        let bits = value.cast_unsigned();
        assert_eq!(only(&written(|w| w.uint64(9, bits))).to_u64(), Ok(bits));
        let fixed = written(|w| w.fixed64(9, bits));
        assert_eq!(only(&fixed).value, Value::Fixed64(bits));
        let narrow = only(&written(|w| w.int64(9, value))).to_i32();
        assert_eq!(narrow.ok(), i32::try_from(value).ok());
        let unsigned = only(&written(|w| w.uint64(9, bits))).to_u32();
        assert_eq!(unsigned.ok(), u32::try_from(bits).ok());
    }
    let minus_one = written(|w| w.uint64(9, 0xffff_ffff));
    assert_eq!(only(&minus_one).to_i32(), Ok(-1));
    assert_eq!(only(&written(|w| w.bool(9, true))).to_u64(), Ok(1));
}

#[test]
fn reals_come_back() {
    for value in [0.0, -0.0, 1.5, f64::MIN_POSITIVE, f64::MAX, f64::INFINITY] {
        let read = only(&written(|w| w.double(3, value))).to_f64();
        assert_eq!(read.map(f64::to_bits), Ok(value.to_bits()));
        let single = value as f32;
        assert_eq!(only(&written(|w| w.float(3, single))).to_f32(), Ok(single));
    }
    let nan = only(&written(|w| w.double(3, f64::NAN))).to_f64();
    assert!(nan.is_ok_and(f64::is_nan));
}

#[test]
fn packed_and_unpacked_doubles_are_the_same() {
    let values = [1.0, -2.5, 3e300];
    let read = |bytes: &[u8]| -> Vec<f64> {
        Fields::new(bytes)
            .flat_map(|field| field.expect("a field").doubles().expect("doubles"))
            .collect()
    };
    assert_eq!(read(&written(|w| w.packed_doubles(1, &values))), values);
    assert_eq!(read(&written(|w| w.repeated_doubles(1, &values))), values);
    assert!(written(|w| w.packed_doubles(1, &[])).is_empty());
    let both = written(|w| {
        w.packed_doubles(1, &values);
        w.double(1, 4.0);
    });
    assert_eq!(read(&both), [1.0, -2.5, 3e300, 4.0]);
}

#[test]
fn integers_of_a_repeated_field_come_back() {
    let values = [0, 1, 300, u64::MAX];
    let bytes = written(|w| w.packed_varints(2, &values));
    let one = written(|w| w.uint64(2, 5));
    for (bytes, values) in [(&bytes, &values[..]), (&one, &[5])] {
        let read: Result<Vec<_>, _> = only(bytes).varints().expect("varints").collect();
        assert_eq!(read.as_deref(), Ok(values));
    }
}

/// Lengths of one, two and three bytes, at every depth.
#[test]
fn nested_messages_of_any_length() {
    for length in [
        0, 1, 100, 125, 126, 127, 128, 129, 5_000, 16_383, 16_384, 40_000,
    ] {
        let body: Vec<u8> = (0..length).map(|i: u32| i as u8).collect();
        let fill = |w: &mut Writer| {
            w.uint64(7, 1);
            w.message(1, |a| {
                a.uint64(2, 2);
                a.message(3, |b| b.bytes(4, &body));
                a.uint64(5, 3);
            });
            w.uint64(6, 4);
        };
        let bytes = written(fill);
        let mut slice = vec![0; bytes.len()];
        let mut writer = Writer::to_slice(&mut slice);
        fill(&mut writer);
        assert_eq!(writer.finish(), Ok(bytes.len()));
        assert_eq!(slice, bytes);
        let outer: Vec<_> = Fields::new(&bytes).map(|f| f.expect("valid")).collect();
        assert!(outer.iter().map(|f| f.number).eq([7, 1, 6]));
        let a = outer[1].message().expect("a message");
        let a: Vec<_> = a.map(|f| f.expect("valid")).collect();
        assert!(a.iter().map(|f| f.number).eq([2, 3, 5]));
        let b = a[1].message().expect("a message").next();
        let b = b.expect("a field").expect("valid");
        assert_eq!(b.to_bytes(), Ok(body.as_slice()));
        assert_eq!(bytes[b.offset..b.offset + body.len()], body);
        // One byte less is too little, at any depth.
        for capacity in 0..bytes.len().min(200) {
            let mut writer = Writer::to_slice(&mut slice[..capacity]);
            fill(&mut writer);
            assert_eq!(writer.finish(), Err(ProtobufError::NoSpace { capacity }));
        }
    }
}

#[test]
fn a_vec_is_appended_to() {
    let mut bytes = vec![1, 2, 3];
    let mut writer = Writer::to_vec(&mut bytes);
    writer.uint64(1, 150);
    assert_eq!(writer.finish(), Ok(3));
    assert_eq!(bytes, [1, 2, 3, 0x08, 0x96, 0x01]);
}

#[test]
fn field_numbers_are_checked() {
    let most = (1 << 29) - 1;
    for (number, valid) in [(0, false), (1, true), (most, true), (most + 1, false)] {
        let mut bytes = Vec::new();
        let mut writer = Writer::to_vec(&mut bytes);
        writer.uint64(number, 1);
        assert_eq!(writer.finish().is_ok(), valid, "{number}");
    }
    let (offset, number) = (0, 0);
    let wrong = ProtobufError::FieldNumber { offset, number };
    assert_eq!(error(&[0x00, 0x01]), wrong);
    let beyond = error(&[0xf8, 0xff, 0xff, 0xff, 0x7f, 0]);
    assert!(matches!(beyond, ProtobufError::FieldNumber { .. }));
}

#[test]
fn broken_bytes_are_named() {
    let truncated = |offset, needed, left| ProtobufError::Truncated {
        offset,
        needed,
        left,
    };
    assert_eq!(error(&[0x08]), truncated(1, 1, 0));
    assert_eq!(error(&[0x08, 0x80]), truncated(1, 2, 1));
    assert_eq!(error(&[0x09, 1, 2]), truncated(1, 8, 2));
    assert_eq!(error(&[0x0d, 1, 2]), truncated(1, 4, 2));
    assert_eq!(error(&[0x0a, 5, 1, 2]), truncated(2, 5, 2));
    let long = [0x08, 255, 255, 255, 255, 255, 255, 255, 255, 255, 2];
    assert_eq!(error(&long), ProtobufError::VarintTooLong { offset: 1 });
    let endless = [0x80; 30];
    assert_eq!(error(&endless), ProtobufError::VarintTooLong { offset: 0 });
    // A length near the end of the address space.
    let huge = [0x0a, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1];
    let huge = error(&huge);
    assert!(matches!(huge, ProtobufError::Truncated { offset: 11, .. }));
    for code in [6, 7] {
        let wrong = ProtobufError::UnknownWireType { offset: 0, code };
        assert_eq!(error(&[0x08 | code]), wrong);
    }
    // Leading zeros are allowed.
    assert_eq!(only(&[0x08, 0x81, 0x80, 0x00]).to_u64(), Ok(1));
}

#[test]
fn errors_inside_count_from_the_outside() {
    // Field 1 at byte 0 contains field 2 (bytes), which lacks one byte.
    let bytes = [0x0a, 3, 0x12, 2, 9];
    let inner = only(&bytes).message().expect("a message").next();
    let wrong = ProtobufError::Truncated {
        offset: 4,
        needed: 2,
        left: 1,
    };
    assert_eq!(inner, Some(Err(wrong)));
}

#[test]
fn values_of_another_type_are_named() {
    let bytes = written(|w| w.uint64(4, 1));
    let field = only(&bytes);
    let wrong = |expected| ProtobufError::WrongWireType {
        offset: 1,
        number: 4,
        expected,
        found: WireType::Varint,
    };
    assert_eq!(field.to_f64(), Err(wrong(WireType::Fixed64)));
    assert_eq!(field.to_f32(), Err(wrong(WireType::Fixed32)));
    assert_eq!(field.to_str(), Err(wrong(WireType::Bytes)));
    assert_eq!(field.doubles().err(), Some(wrong(WireType::Fixed64)));
    let text = written(|w| w.bytes(4, &[b'a', 0xff]));
    let wrong = ProtobufError::NotUtf8 {
        offset: 3,
        number: 4,
    };
    assert_eq!(only(&text).to_str(), Err(wrong));
    let odd = written(|w| w.bytes(4, &[0; 9]));
    let odd = only(&odd).doubles().expect_err("an error");
    assert!(matches!(odd, ProtobufError::PackedLength { length: 9, .. }));
}

#[test]
fn groups_are_skipped() {
    // Group 1 with a varint, a group 2 within, then field 3.
    let bytes = [0x0b, 0x08, 5, 0x13, 0x0d, 1, 2, 3, 4, 0x14, 0x0c, 0x18, 7];
    assert_eq!(only(&bytes).to_u64(), Ok(7));
    let open = error(&[0x0b, 0x08, 5]);
    assert!(matches!(open, ProtobufError::Truncated { offset: 3, .. }));
    let end = |offset, number| ProtobufError::GroupEnd { offset, number };
    assert_eq!(error(&[0x0b, 0x14]), end(1, 2));
    assert_eq!(error(&[0x0c]), end(0, 1));
    let deep = error(&[0x0b; 4000]);
    assert!(matches!(deep, ProtobufError::GroupDepth { .. }));
    let inside = error(&[0x0b, 0x0e]);
    assert!(matches!(inside, ProtobufError::UnknownWireType { .. }));
}

/// Calls every reader on the bytes, to a depth of four.
fn walk(fields: Fields, depth: u32) -> usize {
    let mut count = 0;
    for field in fields {
        let Ok(field) = field else { return count };
        count += 1;
        let _ = (field.to_u32(), field.to_i32());
        let _ = (field.to_f64(), field.to_f32(), field.to_str());
        count += field.doubles().map_or(0, Iterator::count);
        count += field
            .varints()
            .map_or(0, |v| v.filter(Result::is_ok).count());
        if depth > 0
            && let Ok(inner) = field.message()
        {
            count += walk(inner, depth - 1);
        }
    }
    count
}

#[test]
fn any_bytes_are_taken() {
    let mut sampler = Sampler::new(1);
    let mut byte = |below: f64| sampler.uniform(0.0, below) as u8;
    let mut found = 0;
    for round in 0..100_000 {
        let length = usize::from(byte(40.0));
        // Half of them with small bytes, which are more often tags.
        let below = if round % 2 == 0 { 256.0 } else { 64.0 };
        let bytes: Vec<u8> = (0..length).map(|_| byte(below)).collect();
        found += walk(Fields::new(&bytes), 4);
    }
    assert!(found > 10_000, "{found} fields");
}

#[test]
fn nothing_is_allocated() {
    let mut buffer = [0; 512];
    let counted = allocation_counter::measure(|| {
        let mut writer = Writer::to_slice(&mut buffer);
        writer.message(1, |m| {
            m.packed_doubles(1, &[0.5; 20]);
            m.message(2, |n| n.string(1, "name"));
        });
        let length = writer.finish().expect("it fits");
        assert!(walk(Fields::new(&buffer[..length]), 3) > 20);
    });
    assert_eq!(counted.count_total, 0);
}
