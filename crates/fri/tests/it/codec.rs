//! The wire format: known bytes, round trips, frames, broken and random datagrams.

use crate::common::{full_command, full_monitor};
use hwall_fri::codec::{
    ClientCommandMode, Codec, CommandMessage, ConnectionQuality, ControlMode, DATAGRAM_BYTES,
    Datagram, DriveState, InterpolatorData, MonitorMessage, OperationMode, OverlayType, RobotInfo,
    SafetyState, SessionState,
};
use hwall_fri::{FriError, FriVersion};
use hwall_protobuf::{Fields, ProtobufError, Writer};
use hwall_testkit::{Verdict, attack};

fn codecs() -> impl Iterator<Item = Codec> {
    FriVersion::ALL.into_iter().map(Codec::new)
}

fn monitor_bytes(codec: Codec, message: &MonitorMessage) -> Vec<u8> {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let length = codec.encode_monitor(message, &mut buffer);
    buffer[..length.expect("it fits")].to_vec()
}

fn command_bytes(codec: Codec, message: &CommandMessage) -> Vec<u8> {
    let mut buffer: Datagram = [0; DATAGRAM_BYTES];
    let length = codec.encode_command(message, &mut buffer);
    buffer[..length.expect("it fits")].to_vec()
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

/// The public field numbers, written independently.
#[test]
fn field_numbers() {
    let nested = ["1", "2", "3", "4", "5", "3.1", "3.9", "3.15"];
    let seen = |version| {
        let bytes = monitor_bytes(Codec::new(version), &full_monitor());
        let framing = if version.is_framed() { 4 } else { 0 };
        let mut found = Vec::new();
        let message = &bytes[framing..bytes.len() - framing];
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

    let seen = |version| {
        let bytes = command_bytes(Codec::new(version), &full_command());
        let mut found = Vec::new();
        paths(&bytes, &["1", "2", "2.2"], "", &mut found);
        found.join(" ")
    };
    let joints = "1 1.1 1.2 1.3 2 2.1 2.2 2.2.1 2.3";
    assert_eq!(seen(FriVersion::V1_15), joints);
    assert_eq!(seen(FriVersion::V2_5), format!("{joints} 2.6 2.7"));
}

#[test]
fn datagrams_show_their_version() {
    for codec in codecs() {
        let bytes = monitor_bytes(codec, &full_monitor());
        let looks_like = FriVersion::of_datagram(&bytes);
        assert_eq!(looks_like, Some(codec.version));
        assert_eq!(FriVersion::of_datagram(&bytes[..bytes.len() - 9]), None);
        let mut monitor = full_monitor();
        monitor.data = None;
        let bytes = monitor_bytes(codec, &monitor);
        let looks_like = FriVersion::of_datagram(&bytes);
        assert_eq!(looks_like.is_some(), codec.version.is_framed());
    }
}

#[test]
fn messages_come_back() {
    for codec in codecs() {
        let mut monitor = full_monitor();
        let bytes = monitor_bytes(codec, &monitor);
        // Fields that a version does not have are not written.
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
        assert_eq!(codec.decode_monitor(&bytes), Ok(monitor), "{codec:?}");

        let mut command = full_command();
        let bytes = command_bytes(codec, &command);
        if !codec.version.has_cartesian_pose() {
            let data = command.data.as_mut().expect("data");
            (data.pose, data.redundancy) = (None, None);
        }
        assert_eq!(codec.decode_command(&bytes), Ok(command));

        // And without any optional fields.
        (monitor.robot, monitor.data, monitor.interpolator) = (None, None, None);
        monitor.connection.state = SessionState::Idle;
        monitor.connection.receive_multiplier = None;
        let bytes = monitor_bytes(codec, &monitor);
        assert_eq!(codec.decode_monitor(&bytes), Ok(monitor));
        command.data = None;
        let bytes = command_bytes(codec, &command);
        assert_eq!(codec.decode_command(&bytes), Ok(command));
    }
}

/// Every prefix of a datagram and every buffer that is too small are refused.
#[test]
fn truncated_datagrams_and_small_buffers() {
    for codec in codecs() {
        let bytes = monitor_bytes(codec, &full_monitor());
        for capacity in 0..bytes.len() {
            let error = codec.encode_monitor(&full_monitor(), &mut [0; 1500][..capacity]);
            let no_space =
                |e: &FriError| matches!(e, FriError::Wire(ProtobufError::NoSpace { .. }));
            assert!(error.as_ref().is_err_and(no_space), "{error:?}");
            let read = codec.decode_monitor(&bytes[..capacity]);
            if codec.version.is_framed() {
                assert!(read.is_err());
            } else if let Ok(read) = read {
                // Unframed, a cut between two fields leaves a message without optional fields.
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
    // The checksum is right, but the bytes are no message.
    let refused = |datagram: &[u8]| codec.decode_command(datagram).expect_err("damaged");
    assert_eq!(refused(&frame), FriError::Missing("header"));
    frame[12] ^= 1;
    let said = refused(&frame).to_string();
    assert!(said.starts_with("checksum 0xcbf43926, "), "{said}");
    let found = 2;
    assert_eq!(refused(&[1, 2]), FriError::FrameTooShort { found });
    let long = refused(&[255; 40]);
    assert!(matches!(long, FriError::FrameLength { found: 32, .. }));

    let bytes = command_bytes(codec, &full_command());
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(codec.decode_command(&damaged).is_err(), "bit {bit}");
    }
    let longer = [bytes, vec![0; 9]].concat();
    assert!(codec.decode_command(&longer).is_ok(), "bytes behind");
}

/// The header of a message with this identifier.
fn header(w: &mut Writer, id: u64) {
    w.message(1, |m| {
        m.uint64(1, id);
        m.uint64(2, 5);
        m.uint64(3, 6);
    });
}

const MONITOR_ID: u64 = 0x24_5142;
const COMMAND_ID: u64 = 0x3_4001;

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
    let refused = |bytes: &[u8]| codec.decode_command(bytes).expect_err("wrong");
    let unread = |bytes: &[u8]| codec.decode_monitor(bytes).expect_err("wrong");
    assert_eq!(refused(&[]), FriError::Missing("header"));
    let other = written(|w| header(w, MONITOR_ID));
    let (found, expected) = (0x24_5142, 0x3_4001);
    assert_eq!(refused(&other), FriError::OtherMessage { found, expected });
    assert_eq!(unread(&other), FriError::Missing("connection info"));
    let state = written(|w| {
        header(w, MONITOR_ID);
        w.message(4, |m| {
            m.uint64(1, 9);
            m.uint64(2, 1);
        });
    });
    let what = "session state";
    assert_eq!(unread(&state), FriError::UnknownValue { what, value: 9 });
    for (count, packed) in [(6, false), (8, false), (0, true), (14, true)] {
        let joints = written(|w| {
            header(w, COMMAND_ID);
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
        assert_eq!(refused(&joints), wrong);
    }
    // A wrench of six values, wherever unknown fields appear.
    let unknown = written(|w| {
        w.string(77, "unknown");
        header(w, COMMAND_ID);
        w.message(2, |data| {
            data.uint64(99, 1);
            data.message(2, |m| m.packed_doubles(1, &[1.0; 6]));
        });
        w.message(15, |m| m.uint64(1, 0));
    });
    let read = codec.decode_command(&unknown).expect("a command");
    assert_eq!(read.data.and_then(|d| d.wrench), Some([1.0; 6]));
}

/// Numbers of another release, in every enumeration except those of the session.
#[test]
fn unknown_numbers_are_left_out() {
    let bytes = written(|w| {
        header(w, MONITOR_ID);
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

/// Never panics, and everything that can be read can be written.
#[test]
fn mutated_datagrams() {
    let inputs = if cfg!(debug_assertions) {
        20_000
    } else {
        300_000
    };
    let of_codec = |codec| {
        let monitor = monitor_bytes(codec, &full_monitor());
        [monitor, command_bytes(codec, &full_command())]
    };
    let good: Vec<_> = codecs().flat_map(of_codec).collect();
    let report = attack("datagram", &good, inputs, 7, |bytes| {
        let mut verdict = Verdict::Refused;
        for codec in codecs() {
            let monitor = codec.decode_monitor(bytes);
            let monitor = monitor.map(|message| monitor_bytes(codec, &message));
            let command = codec.decode_command(bytes);
            let command = command.map(|message| command_bytes(codec, &message));
            for read in [monitor, command] {
                match read {
                    Ok(_) => verdict = Verdict::Accepted,
                    Err(error) => assert!(!error.to_string().is_empty()),
                }
            }
        }
        verdict
    });
    assert_eq!(report.findings, 0, "{report:?}");
    let least = inputs / 50;
    let fewest = report.accepted.min(report.refused);
    assert!(fewest > least, "{report:?}");
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

/// The public enumeration numbers, written independently: the wire value of each state.
#[test]
fn numbers_of_enumerations() {
    fn numbers<T: Copy + std::fmt::Display>(all: &[T], number: fn(T) -> u64) -> String {
        let each = all
            .iter()
            .map(|value| format!("{value} {}", number(*value)));
        each.collect::<Vec<_>>().join(", ")
    }
    let found = [
        numbers(DriveState::ALL, DriveState::number),
        numbers(SessionState::ALL, SessionState::number),
        numbers(ConnectionQuality::ALL, ConnectionQuality::number),
        numbers(OperationMode::ALL, OperationMode::number),
        numbers(ControlMode::ALL, ControlMode::number),
        numbers(ClientCommandMode::ALL, ClientCommandMode::number),
        numbers(OverlayType::ALL, OverlayType::number),
        numbers(SafetyState::ALL, SafetyState::number),
    ];
    let expected = "\
OFF 0, TRANSITIONING 1, ACTIVE 2
IDLE 0, MONITORING_WAIT 1, MONITORING_READY 2, COMMANDING_WAIT 3, COMMANDING_ACTIVE 4
POOR 0, FAIR 1, GOOD 2, EXCELLENT 3
TEST_MODE_1 0, TEST_MODE_2 1, AUTOMATIC_MODE 2
POSITION_CONTROL_MODE 0, CART_IMP_CONTROL_MODE 1, JOINT_IMP_CONTROL_MODE 2, NO_CONTROL 3
NO_COMMAND_MODE 0, POSITION 1, WRENCH 2, TORQUE 3, CARTESIAN_POSE 4
NO_OVERLAY 0, JOINT 1, CARTESIAN 2
NORMAL_OPERATION 0, SAFETY_STOP_LEVEL_0 1, SAFETY_STOP_LEVEL_1 2, SAFETY_STOP_LEVEL_2 3";
    assert_eq!(found.join("\n"), expected);
}
