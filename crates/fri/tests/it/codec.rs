//! The wire: known bytes, round trips, frames, broken and random datagrams.

use crate::common::{full_command, full_monitor};
use hwall_fri::codec::{
    ArrayEncoding, ClientCommandMode, Codec, ConnectionQuality, ControlMode, DATAGRAM_BYTES,
    Datagram, DriveState, InterpolatorData, OperationMode, OverlayType, RobotInfo, SafetyState,
    SessionState,
};
use hwall_fri::{FriError, FriVersion};
use hwall_protobuf::{Fields, ProtobufError, Writer};
use hwall_testkit::Sampler;

fn codecs() -> impl Iterator<Item = Codec> {
    FriVersion::ALL.into_iter().flat_map(|version| {
        [ArrayEncoding::Unpacked, ArrayEncoding::Packed].map(|arrays| Codec { version, arrays })
    })
}

/// Field numbers, by path, of everything in a message: `"3.1"` is field 1 of message 3.
fn paths(bytes: &[u8], nested: &[&str], prefix: &str, found: &mut Vec<String>) {
    for field in Fields::new(bytes) {
        let field = field.expect("a valid field");
        let path = format!("{prefix}{}", field.number);
        if found.last() != Some(&path) {
            found.push(path.clone());
        }
        if nested.contains(&path.as_str()) {
            let inner = field.to_bytes().expect("a message");
            paths(inner, nested, &format!("{path}."), found);
        }
    }
}

/// The public field numbers, written down once more.
#[test]
fn field_numbers() {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let nested = ["1", "2", "3", "4", "5", "3.1", "3.9", "3.15"];
    let mut seen = |version| {
        let codec = Codec::new(version);
        let length = codec
            .encode_monitor(&full_monitor(), &mut buffer)
            .expect("it fits");
        let message = match version.is_framed() {
            true => &buffer[4..length - 4],
            false => &buffer[..length],
        };
        let mut found = Vec::new();
        paths(message, &nested, "", &mut found);
        found.join(" ")
    };
    let head = "1 1.1 1.2 1.3 2 2.1 2.2 2.5 2.6 2.7 3 3.1 3.1.1 3.2";
    let foot = "3.15 3.15.1 3.15.2 4 4.1 4.2 4.3 4.4 5 5.1";
    let pose = "3.9 3.9.1 3.9.2 3.10";
    let last = "5.10 5.11 5.12";
    let expected = format!("{head} 3.3 3.4 3.5 {foot} {last}");
    assert_eq!(seen(FriVersion::V1_15), expected);
    let expected = format!("{head} 3.4 3.5 {pose} {foot} 5.2 5.3 {last}");
    assert_eq!(seen(FriVersion::V2_5), expected);
    let expected = format!("{head} 3.4 3.5 3.6 {pose} {foot} 5.2 5.3 {last}");
    assert_eq!(seen(FriVersion::V2_7), expected);

    let mut seen = |version| {
        let codec = Codec::new(version);
        let length = codec
            .encode_command(&full_command(), &mut buffer)
            .expect("it fits");
        let mut found = Vec::new();
        paths(&buffer[..length], &["1", "2", "2.2"], "", &mut found);
        found.join(" ")
    };
    let joints = "1 1.1 1.2 1.3 2 2.1 2.2 2.2.1 2.3";
    assert_eq!(seen(FriVersion::V1_15), joints);
    assert_eq!(seen(FriVersion::V2_5), format!("{joints} 2.6 2.7"));
}

#[test]
fn datagrams_show_their_version() {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for codec in codecs() {
        let length = codec
            .encode_monitor(&full_monitor(), &mut buffer)
            .expect("it fits");
        let looks_like = FriVersion::of_datagram(&buffer[..length]);
        assert_eq!(looks_like, Some(codec.version));
        assert_eq!(FriVersion::of_datagram(&buffer[..length - 9]), None);
        let mut monitor = full_monitor();
        monitor.data = None;
        let length = codec
            .encode_monitor(&monitor, &mut buffer)
            .expect("it fits");
        let looks_like = FriVersion::of_datagram(&buffer[..length]);
        assert_eq!(looks_like.is_some(), codec.version.is_framed());
    }
}

#[test]
fn messages_come_back() {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for codec in codecs() {
        let mut monitor = full_monitor();
        let length = codec
            .encode_monitor(&monitor, &mut buffer)
            .expect("it fits");
        // What a version does not have is not written.
        let data = monitor.data.as_mut().expect("data");
        let interpolator = monitor.interpolator.as_mut().expect("data");
        if !codec.version.has_commanded_position() {
            data.commanded_position_rad = None;
        }
        if !codec.version.has_cartesian_pose() {
            (data.pose, data.redundancy) = (None, None);
            (interpolator.pose, interpolator.redundancy) = (None, None);
        }
        if !codec.version.has_external_force() {
            data.external_force = None;
        }
        assert_eq!(
            codec.decode_monitor(&buffer[..length]),
            Ok(monitor),
            "{codec:?}"
        );
        // A reader takes both ways of writing numbers.
        let other = Codec::new(codec.version);
        assert_eq!(other.decode_monitor(&buffer[..length]), Ok(monitor));

        let mut command = full_command();
        let length = codec
            .encode_command(&command, &mut buffer)
            .expect("it fits");
        if !codec.version.has_cartesian_pose() {
            let data = command.data.as_mut().expect("data");
            (data.pose, data.redundancy) = (None, None);
        }
        assert_eq!(codec.decode_command(&buffer[..length]), Ok(command));

        // And with nothing in them that may be absent.
        (monitor.robot, monitor.data, monitor.interpolator) = (None, None, None);
        monitor.connection.state = SessionState::Idle;
        monitor.connection.receive_multiplier = None;
        let length = codec
            .encode_monitor(&monitor, &mut buffer)
            .expect("it fits");
        assert_eq!(codec.decode_monitor(&buffer[..length]), Ok(monitor));
        command.data = None;
        let length = codec
            .encode_command(&command, &mut buffer)
            .expect("it fits");
        assert_eq!(codec.decode_command(&buffer[..length]), Ok(command));
    }
}

/// Every prefix of a datagram is refused, and every buffer that is too small.
#[test]
fn truncated_datagrams_and_small_buffers() {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for codec in codecs() {
        let length = codec
            .encode_monitor(&full_monitor(), &mut buffer)
            .expect("it fits");
        for capacity in 0..length {
            let error = codec.encode_monitor(&full_monitor(), &mut [0; 1500][..capacity]);
            let no_space =
                |e: &FriError| matches!(e, FriError::Wire(ProtobufError::NoSpace { .. }));
            assert!(error.as_ref().is_err_and(no_space), "{error:?}");
            let read = codec.decode_monitor(&buffer[..capacity]);
            if codec.version.is_framed() {
                assert!(read.is_err());
            } else if let Ok(read) = read {
                // Unframed, a cut between two fields leaves a message without what may be absent.
                assert_ne!(read, full_monitor());
            }
        }
    }
}

/// The check value of the zlib polynomial: that of "123456789" is 0xCBF43926.
#[test]
fn frames() {
    let codec = Codec::new(FriVersion::V2_7);
    let mut frame = Vec::new();
    frame.extend_from_slice(&9_u32.to_le_bytes());
    frame.extend_from_slice(b"123456789");
    frame.extend_from_slice(&0xCBF4_3926_u32.to_le_bytes());
    // The checksum holds, the message is none.
    assert_eq!(
        codec.decode_command(&frame),
        Err(FriError::Missing("header"))
    );
    frame[12] ^= 1;
    let wrong = codec.decode_command(&frame);
    assert!(
        matches!(
            wrong,
            Err(FriError::Checksum {
                stated: 0xCBF4_3926,
                ..
            })
        ),
        "{wrong:?}"
    );
    assert_eq!(
        codec.decode_command(&[1, 2]),
        Err(FriError::FrameTooShort { found: 2 })
    );
    let long = codec.decode_command(&[255; 40]);
    assert!(
        matches!(long, Err(FriError::FrameLength { found: 32, .. })),
        "{long:?}"
    );

    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let length = codec
        .encode_command(&full_command(), &mut buffer)
        .expect("it fits");
    for bit in 0..8 * length {
        let mut damaged = buffer;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(
            codec.decode_command(&damaged[..length]).is_err(),
            "bit {bit}"
        );
    }
    assert!(
        codec.decode_command(&buffer).is_ok(),
        "bytes behind the frame"
    );
}

fn written(body: impl FnOnce(&mut Writer)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = Writer::to_vec(&mut bytes);
    body(&mut writer);
    writer.finish().expect("a message");
    bytes
}

#[test]
fn what_is_missing_or_wrong_is_named() {
    let codec = Codec::new(FriVersion::V1_15);
    let header = |w: &mut Writer, id| {
        w.message(1, |m| {
            m.uint64(1, id);
            m.uint64(2, 5);
            m.uint64(3, 6);
        });
    };
    assert_eq!(codec.decode_command(&[]), Err(FriError::Missing("header")));
    let other = written(|w| header(w, 0x24_5142));
    let (found, expected) = (0x24_5142, 0x3_4001);
    assert_eq!(
        codec.decode_command(&other),
        Err(FriError::OtherMessage { found, expected })
    );
    assert_eq!(
        codec.decode_monitor(&other),
        Err(FriError::Missing("connection info"))
    );
    let state = written(|w| {
        header(w, 0x24_5142);
        w.message(4, |m| {
            m.uint64(1, 9);
            m.uint64(2, 1);
        });
    });
    let what = "session state";
    assert_eq!(
        codec.decode_monitor(&state),
        Err(FriError::UnknownValue { what, value: 9 })
    );
    for (count, packed) in [(6, false), (8, false), (0, true), (14, true)] {
        let joints = written(|w| {
            header(w, 0x3_4001);
            w.message(2, |data| {
                data.message(1, |m| match packed {
                    true => m.packed_doubles(1, &vec![0.5; count]),
                    false => m.repeated_doubles(1, &vec![0.5; count]),
                });
            });
        });
        let wrong = FriError::WrongLength {
            what: "commanded positions",
            found: count,
            expected: 7,
        };
        assert_eq!(codec.decode_command(&joints), Err(wrong));
    }
    // A wrench of six, wherever unknown fields stand.
    let unknown = written(|w| {
        w.string(77, "unknown");
        header(w, 0x3_4001);
        w.message(2, |data| {
            data.uint64(99, 1);
            data.message(2, |m| m.packed_doubles(1, &[1.0; 6]));
        });
        w.message(15, |m| m.uint64(1, 0));
    });
    let read = codec.decode_command(&unknown).expect("a command");
    assert_eq!(read.data.and_then(|d| d.wrench), Some([1.0; 6]));
}

/// Numbers of another release, in every enumeration but those of the session.
#[test]
fn unknown_numbers_are_left_out() {
    let bytes = written(|w| {
        w.message(1, |m| {
            m.uint64(1, 0x24_5142);
            m.uint64(2, 5);
            m.uint64(3, 6);
        });
        w.message(2, |m| {
            for field in [2, 6, 7] {
                m.uint64(field, 99);
            }
            m.packed_varints(5, &[2, 2, 2, 99, 2, 2, 2]);
        });
        w.message(4, |m| {
            m.uint64(1, 4);
            m.uint64(2, 3);
        });
        w.message(5, |m| {
            m.uint64(10, 99);
            m.uint64(11, 99);
        });
    });
    let read = Codec::new(FriVersion::V1_15).decode_monitor(&bytes);
    let read = read.expect("a message");
    assert_eq!(read.robot, Some(RobotInfo::default()));
    assert_eq!(read.interpolator, Some(InterpolatorData::default()));
}

#[test]
fn texts_of_versions_and_modes() {
    for &mode in ClientCommandMode::ALL {
        assert_eq!(mode.to_string().to_lowercase().parse(), Ok(mode));
    }
    let wrong: Result<ClientCommandMode, _> = "force".parse();
    assert_eq!(wrong, Err(FriError::UnknownMode("force".to_owned())));
    for version in FriVersion::ALL {
        assert_eq!(version.to_string().parse(), Ok(version));
    }
    let wrong: Result<FriVersion, _> = "3.0".parse();
    assert_eq!(wrong, Err(FriError::UnknownVersion("3.0".to_owned())));
}

/// Datagrams with bytes changed, cut, doubled or made up: never a panic, and whatever is read can be written.
#[test]
fn mutated_datagrams() {
    let rounds = if cfg!(debug_assertions) {
        60_000
    } else {
        1_000_000
    };
    let mut sampler = Sampler::new(7);
    let mut originals = Vec::new();
    for codec in codecs() {
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let length = codec
            .encode_monitor(&full_monitor(), &mut buffer)
            .expect("it fits");
        originals.push(buffer[..length].to_vec());
        let length = codec
            .encode_command(&full_command(), &mut buffer)
            .expect("it fits");
        originals.push(buffer[..length].to_vec());
    }
    let mut below = |n: usize| sampler.uniform(0.0, n as f64) as usize % n.max(1);
    let (mut read, mut refused) = (0, 0);
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for round in 0..rounds {
        let mut bytes = originals[round % originals.len()].clone();
        for _ in 0..1 + below(4) {
            let at = below(bytes.len());
            match below(5) {
                0 => bytes[at] = below(256) as u8,
                1 => bytes[at] ^= 1 << below(8),
                2 => bytes.truncate(at.max(1)),
                3 => bytes.insert(at, below(256) as u8),
                _ => {
                    let end = (at + below(20)).min(bytes.len());
                    let part = bytes[at..end].to_vec();
                    bytes.extend(part);
                }
            }
        }
        for version in FriVersion::ALL {
            let codec = Codec::new(version);
            match codec.decode_monitor(&bytes) {
                Ok(message) => {
                    read += 1;
                    codec
                        .encode_monitor(&message, &mut buffer)
                        .expect("it fits");
                }
                Err(error) => {
                    refused += 1;
                    assert!(round % 1000 != 0 || !error.to_string().is_empty());
                }
            }
            match codec.decode_command(&bytes) {
                Ok(message) => {
                    read += 1;
                    codec
                        .encode_command(&message, &mut buffer)
                        .expect("it fits");
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(
        read > rounds / 20 && refused > rounds,
        "{read} read, {refused} refused"
    );
}

#[test]
fn nothing_is_allocated() {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    for codec in codecs() {
        let counted = allocation_counter::measure(|| {
            let length = codec
                .encode_monitor(&full_monitor(), &mut buffer)
                .expect("it fits");
            codec.decode_monitor(&buffer[..length]).expect("a message");
            codec
                .decode_monitor(&buffer[..length / 2])
                .expect_err("half a message");
            let length = codec
                .encode_command(&full_command(), &mut buffer)
                .expect("it fits");
            codec.decode_command(&buffer[..length]).expect("a message");
        });
        assert_eq!(counted.count_total, 0, "{codec:?}");
    }
}

/// The public numbers of the enumerations, written down once more: what each value stands for on the wire.
#[test]
fn numbers_of_enumerations() {
    fn numbers<T: Copy + std::fmt::Display>(all: &[T], number: fn(T) -> u64) -> String {
        let each = all
            .iter()
            .map(|value| format!("{value} {}", number(*value)));
        each.collect::<Vec<_>>().join(", ")
    }
    assert_eq!(
        numbers(DriveState::ALL, DriveState::number),
        "OFF 0, TRANSITIONING 1, ACTIVE 2"
    );
    assert_eq!(
        numbers(SessionState::ALL, SessionState::number),
        "IDLE 0, MONITORING_WAIT 1, MONITORING_READY 2, COMMANDING_WAIT 3, COMMANDING_ACTIVE 4"
    );
    assert_eq!(
        numbers(ConnectionQuality::ALL, ConnectionQuality::number),
        "POOR 0, FAIR 1, GOOD 2, EXCELLENT 3"
    );
    assert_eq!(
        numbers(OperationMode::ALL, OperationMode::number),
        "TEST_MODE_1 0, TEST_MODE_2 1, AUTOMATIC_MODE 2"
    );
    assert_eq!(
        numbers(ControlMode::ALL, ControlMode::number),
        "POSITION_CONTROL_MODE 0, CART_IMP_CONTROL_MODE 1, JOINT_IMP_CONTROL_MODE 2, NO_CONTROL 3"
    );
    assert_eq!(
        numbers(ClientCommandMode::ALL, ClientCommandMode::number),
        "NO_COMMAND_MODE 0, POSITION 1, WRENCH 2, TORQUE 3, CARTESIAN_POSE 4"
    );
    assert_eq!(
        numbers(OverlayType::ALL, OverlayType::number),
        "NO_OVERLAY 0, JOINT 1, CARTESIAN 2"
    );
    assert_eq!(SafetyState::NormalOperation.number(), 0);
    assert_eq!(SafetyState::StopLevel2.number(), 3);
}

/// Length and checksum at the end of a message of either kind, which some senders write.
#[test]
fn the_end_of_a_message_is_skipped() {
    let codec = Codec::new(FriVersion::V1_15);
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let end = written(|w| {
        w.message(15, |m| {
            m.uint64(1, 0xffff_ffff_ffff_ffff);
            m.message(2, |checksum| checksum.uint64(1, 7));
        });
    });
    let command = codec
        .encode_command(&full_command(), &mut buffer)
        .expect("it fits");
    let with_end = [&buffer[..command], &end[..]].concat();
    assert_eq!(
        codec.decode_command(&with_end).expect("a command"),
        codec.decode_command(&buffer[..command]).expect("a command")
    );
    let state = codec
        .encode_monitor(&full_monitor(), &mut buffer)
        .expect("it fits");
    let with_end = [&buffer[..state], &end[..]].concat();
    assert_eq!(
        codec.decode_monitor(&with_end).expect("a state"),
        codec.decode_monitor(&buffer[..state]).expect("a state")
    );
}
