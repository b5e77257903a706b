//! The dissertation's datagrams over loopback, up to the board that follows them.

use crate::common::{arm, until, wait_for};
use hwall::glam::DVec3;
use hwall::haptics::{Arm, PlaceTolerance, RendererConfig};
use hwall::kinematics::JointPositions;
use hwall::{Controller, TargetControl};
use hwall_bridge::{BoardDatagram, RoughnessCode, UnityConfig, UnityReceiver};
use hwall_sim::{ServoArm, ServoConfig};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;

fn receiver() -> UnityReceiver {
    UnityReceiver::start(UnityConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        ..UnityConfig::default()
    })
    .expect("a receiver")
}

fn sender(receiver: &UnityReceiver) -> UdpSocket {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
    socket.connect(receiver.address()).expect("an address");
    socket
}

fn datagram() -> BoardDatagram {
    BoardDatagram {
        orientation_deg: 0.0,
        position_mm: [600.0, 0.0, 500.0],
        is_dynamic: false,
        roughness: RoughnessCode::default(),
    }
}

#[test]
fn the_newest_datagram_of_the_first_sender_counts() {
    let mut receiver = receiver();
    let (one, two) = (sender(&receiver), sender(&receiver));
    assert!(receiver.newest(0.0).is_none());
    for x_mm in [500.0, 550.0, 600.0] {
        let sent = BoardDatagram {
            position_mm: [x_mm, -100.0, 500.0],
            orientation_deg: 90.0,
            is_dynamic: true,
            roughness: RoughnessCode::new(2, 3).expect("two digits"),
        };
        one.send(&sent.encode().expect("bytes")).expect("sent");
    }
    wait_for("three of them", || receiver.counts().datagrams == 3);
    let bytes = datagram().encode().expect("bytes");
    two.send(&bytes).expect("sent");
    one.send(&bytes[..19]).expect("sent");
    one.send(&[0; 21]).expect("sent");
    one.send(&[0xff; 20]).expect("sent");
    wait_for("four refused", || receiver.counts().refused_datagrams == 4);
    let told = receiver.newest(7.5).expect("a target");
    assert!(told.is_dynamic && told.target.stamp_s == 7.5);
    assert!(told.target.point_m.distance(DVec3::new(0.6, -0.1, 0.5)) < 1e-12);
    assert!(told.target.normal.distance(DVec3::Y) < 1e-12);
    assert_eq!(told.target.roll_rad, Some(45_f64.to_radians()));
    let slide = told.slide.expect("a motion");
    assert!((slide.velocity_m_per_s.length() - 0.03).abs() < 1e-12);
    let out_of_plane = slide.velocity_m_per_s.dot(DVec3::Y);
    assert!(out_of_plane.abs() < 1e-12, "{out_of_plane}");
    assert!(receiver.newest(8.0).is_none(), "seen once");
}

/// Regression: the board was sent to the arm's base.
#[test]
fn zeros_are_no_place() {
    let mut receiver = receiver();
    let socket = sender(&receiver);
    let send = |datagram: BoardDatagram| {
        let bytes = datagram.encode().expect("bytes");
        socket.send(&bytes).expect("sent");
    };
    let zeros = BoardDatagram {
        position_mm: [0.0, -0.0, 0.0],
        ..datagram()
    };
    send(zeros);
    send(datagram());
    for _ in 0..3 {
        send(zeros);
    }
    wait_for("four without a place", || {
        receiver.counts().unseen_datagrams == 4
    });
    let told = receiver.newest(1.0).expect("the place before");
    assert!(told.target.point_m.distance(DVec3::new(0.6, 0.0, 0.5)) < 1e-9);
    socket.send(&[0; 20]).expect("sent");
    wait_for("all zeros", || receiver.counts().unseen_datagrams == 5);
    assert!(receiver.newest(2.0).is_none());
    assert_eq!(receiver.counts().refused_datagrams, 0);
}

#[test]
fn a_board_goes_where_it_is_told() {
    let mut receiver = receiver();
    let socket = sender(&receiver);
    let (arm, board) = arm();
    let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let mut control =
        TargetControl::new(&arm, &board, RendererConfig::default()).expect("a controller");
    let model = Arc::clone(control.renderer().arm());
    let mut servo = ServoArm::new(model, start, ServoConfig::default()).expect("an arm");
    let bytes = datagram().encode().expect("bytes");
    let mut cycle = 0_u32;
    until("the board in its place", || {
        let now_s = 1e-3 * f64::from(cycle);
        if cycle.is_multiple_of(20) {
            socket.send(&bytes).expect("sent");
        }
        cycle += 1;
        if let Some(told) = receiver.newest(now_s) {
            control.target = Some(told.target);
        }
        let state = servo.state().expect("a state");
        servo.command(control.step(now_s, &state)).expect("taken");
        control.plan();
        servo.advance(1e-3).expect("a period");
        PlaceTolerance::default()
            .holds(&board, &servo.pose(), DVec3::new(0.6, 0.0, 0.5), DVec3::X)
            .then_some(())
    });
}

#[test]
fn an_address_in_use_is_named() {
    let first = receiver();
    let second = UnityReceiver::start(UnityConfig {
        listen: first.address(),
        ..UnityConfig::default()
    });
    let error = second.err().expect("taken").to_string();
    assert!(error.contains(&first.address().to_string()), "{error}");
}
