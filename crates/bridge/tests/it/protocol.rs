//! A bridge over loopback: possible inputs of clients, and what the loop gets.

use crate::common::{
    Socket, answer, arm, hand, hand_at, joints, scene, server, text_of, until, wait_for,
};
use glam::DVec3;
use hwall::hand::HandFrame;
use hwall::kinematics::JointPositions;
use hwall_bridge::view::{ViewFrame, ViewState};
use hwall_bridge::{Bridge, BridgeConfig, BridgeServer};
use hwall_testkit::Sampler;
use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Runs the hands' end of a loop at 1 kHz until a frame satisfies `wanted`.
fn frame(bridge: &mut Bridge, wanted: impl Fn(&HandFrame) -> bool) -> HandFrame {
    until("a frame", || {
        let now_s = bridge.pacing.wait();
        bridge.hands.next_frame(now_s).filter(&wanted)
    })
}

/// A sample of a hand within reach.
fn good(seq: u64, client_ms: f64) -> String {
    hand_at(seq, client_ms, DVec3::new(0.5, 0.0, 0.4))
}

#[test]
fn a_hand_in_webxr_axes_arrives_in_the_base_frame() {
    let origin = hwall::geometry::Pose::from_yaw(std::f64::consts::PI, DVec3::new(1.5, 0.0, -0.6));
    let server = server(BridgeConfig {
        base_from_headset: origin.expect("a pose"),
        ..BridgeConfig::default()
    });
    let mut bridge = server.connect(&scene());
    let mut socket = Socket::open(&server);
    socket.text(&hand(1, 10.0, &joints(25, [0.1, 1.2, -0.4]), "webxr"));
    let seen = frame(&mut bridge, |f| f.palm_m.is_some());
    // 0.4 m ahead of the wearer, who faces the arm from 1.5 m; 0.1 m to their right; 1.2 m above their floor.
    let expected = DVec3::new(1.1, 0.1, 0.6);
    for point in seen.points() {
        let is_there = point.is_some_and(|m| m.distance(expected) < 1e-12);
        assert!(is_there, "{point:?}");
    }
    socket.text(&hand(2, 20.0, &joints(26, [0.1, 0.2, 0.3]), "base"));
    let seen = frame(&mut bridge, |f| f.palm_m.is_some());
    assert_eq!(seen.palm_m, Some(DVec3::new(0.1, 0.2, 0.3)));
    let newest = bridge.hands.newest();
    let count = newest.map(|(_, joints_m)| joints_m.iter().flatten().count());
    assert_eq!(count, Some(26));
}

#[test]
fn a_client_that_falls_silent_leaves_a_lost_hand_and_comes_back() {
    let server = server(BridgeConfig::default());
    let mut bridge = server.connect(&scene());
    let mut last_s = f64::NEG_INFINITY;
    for connection in 0..3 {
        let mut socket = Socket::open(&server);
        let seq = 1 + 1000 * connection;
        socket.text(&good(seq, 1e3 + seq as f64));
        let seen = frame(&mut bridge, |f| f.palm_m.is_some());
        assert!(seen.t_s > last_s, "one clock for all connections");
        // Regression: after a client had left, its head counted as missing for ever.
        assert_eq!(seen.is_of_another, connection > 0);
        last_s = seen.t_s;
        drop(socket);
        let lost = frame(&mut bridge, |f| f.points() == [None; 6]);
        assert!(lost.t_s > last_s + 0.1);
        last_s = lost.t_s;
    }
    assert_eq!(server.counts().accepted, 3);
    // A hand that is not seen is reported at once.
    let mut socket = Socket::open(&server);
    socket.text(&hand(1, 1.0, "null", "webxr"));
    socket.text(&good(2, 15.0));
    socket.text(&hand(3, 29.0, "null", "webxr"));
    frame(&mut bridge, |f| f.palm_m.is_some());
    frame(&mut bridge, |f| f.palm_m.is_none());
    wait_for("the count", || server.counts().unseen == 1);
}

#[test]
fn a_client_whose_stamps_are_seconds_is_told() {
    let server = server(BridgeConfig::default());
    let _bridge = server.connect(&scene());
    let mut socket = Socket::open(&server);
    let began = Instant::now();
    let mut seq = 0;
    wait_for("the count", || {
        seq += 1;
        let stamp = 1.7e9 + began.elapsed().as_secs_f64();
        socket.text(&good(seq, stamp));
        std::thread::sleep(Duration::from_millis(10));
        server.counts().in_seconds > 0
    });
    let said = socket.wait_for("error");
    assert!(text_of(&said, "text").contains("seconds"), "{said}");
}

#[test]
fn what_is_wrong_is_dropped_counted_and_said() {
    let server = server(BridgeConfig::default());
    let mut bridge = server.connect(&scene());
    let mut socket = Socket::open(&server);
    socket.text(&good(1, 1000.0));
    for wrong in [
        "no JSON".to_owned(),
        hand(2, 1010.0, &joints(24, [0.5, 0.0, 0.4]), "base"),
        hand(2, 1010.0, "[[1,2,3]]", "base"),
        good(2, 1010.0).replace("0.5,0,0.4", "NaN,0,0"),
        good(2, 1010.0).replace("0.5,0,0.4", "1e99,0,0"),
    ] {
        socket.text(&wrong);
    }
    socket.send(Message::binary(vec![1, 2, 3]));
    socket.text(&good(1, 1014.0));
    socket.text(&good(0, 1014.0));
    socket.text(&good(3, 900.0));
    socket.text(&good(4, 1028.0));
    wait_for("all of them", || server.counts().accepted == 2);
    let counts = server.counts();
    assert_eq!(counts.malformed, 6);
    assert_eq!((counts.duplicate, counts.out_of_order), (1, 2));
    let said = socket.wait_for("error");
    assert!(text_of(&said, "text").contains("message refused"), "{said}");
    socket.text(r#"{"type":"ping","id":7,"client_ms":5.5}"#);
    let pong = socket.wait_for("pong");
    assert!(pong["id"] == 7.0 && pong["client_ms"] == 5.5 && pong["server_ms"].is_number());
    let told = socket.wait_for("counts");
    assert!(told["malformed"] == 6 && told["leads"] == true, "{told}");
    frame(&mut bridge, |f| f.palm_m.is_some());
}

#[test]
fn too_large_a_message_ends_the_connection_and_no_other() {
    let server = server(BridgeConfig::default());
    let _bridge = server.connect(&scene());
    let (mut large, mut other) = (Socket::open(&server), Socket::open(&server));
    wait_for("both", || server.counts().clients == 2);
    large.text(&format!("\"{}\"", "x".repeat(70_000)));
    wait_for("its end", || server.counts().clients == 1);
    assert_eq!(server.counts().too_large, 1);
    other.text(&good(1, 1.0));
    wait_for("the other", || server.counts().accepted == 1);
}

#[test]
fn those_who_are_too_many_are_told_and_turned_away() {
    let server = server(BridgeConfig {
        max_clients: 2,
        ..BridgeConfig::default()
    });
    let (one, _two) = (Socket::open(&server), Socket::open(&server));
    wait_for("two clients", || server.counts().clients == 2);
    let mut three = Socket::open(&server);
    let said = three.wait_for("error");
    assert!(text_of(&said, "text").contains("too many"), "{said}");
    wait_for("the refusal", || server.counts().refused_clients == 1);
    drop(one);
    wait_for("one to leave", || server.counts().clients == 1);
    Socket::open(&server).wait_for("preparing");
}

#[test]
fn a_scene_reaches_those_who_wait_and_those_who_come() {
    let server = server(BridgeConfig::default());
    let mut early = Socket::open(&server);
    assert_eq!(text_of(&early.wait_for("preparing"), "text"), "preparing");
    server.prepare("learning");
    assert_eq!(text_of(&early.wait_for("preparing"), "text"), "learning");
    // A room of 300,000 triangles is sent in full.
    let large = "x".repeat(8_000_000);
    server.prepare(&large);
    assert!(text_of(&early.wait_for("preparing"), "text") == large);
    let bridge = server.connect(&scene());
    let mut late = Socket::open(&server);
    for socket in [&mut early, &mut late] {
        assert!(socket.wait_for("scene")["surfaces"].is_array());
    }
    drop(bridge);
}

const FOREIGN: &[u8] = b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n";

#[test]
fn requests_are_answered_with_the_page_or_refused() {
    let server = server(BridgeConfig {
        request_s: 0.3,
        ..BridgeConfig::default()
    });
    let get = |path: &str, more: &str| {
        format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n{more}\r\n").into_bytes()
    };
    for (request, status) in [
        (get("/", ""), "200"),
        (get("/?a=../../b", ""), "200"),
        (get("/favicon.ico", ""), "204"),
        (get("/../../etc/passwd", ""), "404"),
        (get("/%2e%2e/etc/passwd", ""), "404"),
        (get("/", "Origin: https://evil.example\r\n"), "403"),
        (FOREIGN.to_vec(), "403"),
        (b"\x16\x03\x01\0\xc8\r\n\r\n\r\n".to_vec(), "400"),
        (get("/", &format!("X: {}\r\n", "a".repeat(9000))), "431"),
        (get("/", &"X: a\r\n".repeat(100)), "400"),
        // Never completed.
        (b"GET / HTTP/1.1\r\nHost: loc".to_vec(), "408"),
    ] {
        let answer = answer(server.address(), &request);
        let line = answer.lines().next().unwrap_or_default();
        assert!(line.contains(status), "{line:?}, expected {status}");
    }
    let still = answer(server.address(), &get("/", ""));
    assert!(still.starts_with("HTTP/1.1 200"), "it still serves");
}

/// Regression: a server behind a proxy, at an address of this machine, had no key.
#[test]
fn a_server_that_others_reach_asks_for_its_key() {
    let plain = |host: &[&str], ip: [u8; 4]| {
        let config = BridgeConfig {
            listen: (ip, 0).into(),
            hosts: host.iter().map(|host| (*host).to_owned()).collect(),
            ..BridgeConfig::default()
        };
        BridgeServer::start(config).expect("a server")
    };
    let local = plain(&[], [127, 0, 0, 1]);
    assert!(local.url().ends_with('/') && !local.invitation().contains("key"));
    assert!(plain(&[], [0, 0, 0, 0]).url().contains("/?key="));
    let behind = plain(&["my.proxy.example"], [127, 0, 0, 1]);
    let url = behind.url();
    let (_, query) = url.split_once("/?key=").expect("a key");
    assert!(behind.invitation().contains("can open the page"));
    for (path, status) in [("/", "403"), (&format!("/?key={query}"), "200")] {
        let head = format!("GET {path} HTTP/1.1\r\nHost: my.proxy.example\r\n\r\n");
        let answer = answer(behind.address(), head.as_bytes());
        let begins = format!("HTTP/1.1 {status} ");
        assert!(answer.starts_with(&begins), "{answer}");
    }
}

#[test]
fn a_request_drop_by_drop_is_cut_off() {
    let server = server(BridgeConfig {
        request_s: 0.3,
        ..BridgeConfig::default()
    });
    let mut stream = TcpStream::connect(server.address()).expect("a connection");
    let drops = b"GET / HTTP/1.1\r\nHost: localhost\r\nX: "
        .iter()
        .chain(std::iter::repeat(&b'a'));
    // Every byte comes in time, but not all of them together.
    let refused = drops.take(1000).any(|byte| {
        std::thread::sleep(Duration::from_millis(10));
        stream.write_all(&[*byte]).is_err() || server.counts().refused_requests > 0
    });
    assert!(refused);
}

#[test]
fn no_bytes_harm_the_server() {
    let server = server(BridgeConfig {
        request_s: 0.2,
        ..BridgeConfig::default()
    });
    let _bridge = server.connect(&scene());
    let mut sampler = Sampler::new(11);
    for round in 0..60 {
        let mut stream = TcpStream::connect(server.address()).expect("a connection");
        if round % 2 == 0 {
            // After the handshake, so that the frames are garbage.
            stream.write_all(b"GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").expect("a handshake");
        }
        let bytes: Vec<u8> = (0..sampler.index(3000))
            .map(|_| sampler.index(256) as u8)
            .collect();
        let _ = stream.write_all(&bytes);
    }
    wait_for("all of them to leave", || server.counts().clients == 0);
    // At most half of the connections are from one address.
    wait_for("room", || {
        let head = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        answer(server.address(), head).starts_with("HTTP/1.1 200")
    });
    let mut socket = Socket::open(&server);
    socket.text(&good(1, 1.0));
    wait_for("a hand", || server.counts().accepted == 1);
}

#[test]
fn a_server_that_is_stopped_lets_go() {
    let server = server(BridgeConfig::default());
    let bridge = server.connect(&scene());
    let _socket = Socket::open(&server);
    let address = server.address();
    server.stop_handle().stop();
    assert!(bridge.view.is_stopped());
    drop(server);
    assert!(TcpStream::connect(address).is_err(), "nobody listens");
}

/// One client wants JSON, another one bytes; the board is where the arm's kinematics places it.
#[test]
fn views_come_as_json_to_whoever_asks_for_them() {
    let server = server(BridgeConfig::default());
    let mut bridge = server.connect(&scene());
    let mut json = Socket::open_at(&server, "/ws?format=json");
    let mut binary = Socket::open_at(&server, "/ws?format=other");
    for socket in [&mut json, &mut binary] {
        socket.wait_for("scene");
    }
    let q = JointPositions([0.1, 0.5, -0.2, -1.2, 0.3, 0.7, 0.4]);
    let frame = ViewFrame {
        goal: Some((DVec3::new(0.6, 0.1, 0.5), DVec3::NEG_X)),
        force_n: Some(DVec3::splat(f64::NAN)),
        state: ViewState::Approaching,
        ..ViewFrame::new(1.5, q)
    };
    bridge.view.send(&frame);
    let view = json.wait_for("view");
    let expected = arm().0.forward(&q);
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    for i in 0..3 {
        let off_m = number(&view["board"]["position"][i]) - expected.position_m()[i];
        assert!(off_m.abs() < 1e-9, "{view}");
    }
    assert_eq!(view["t"], 1.5);
    assert_eq!(view["state"], "approaching");
    assert_eq!(view["goal"]["normal"], serde_json::json!([-1.0, 0.0, 0.0]));
    assert!(view["hand"].is_null() && view["force"][0].is_null());
    let bytes = until("bytes", || match binary.0.read() {
        Ok(Message::Binary(bytes)) => Some(bytes),
        _ => None,
    });
    let (decoded, _) = ViewFrame::decode(&bytes).expect("a view");
    assert_eq!(decoded.state, ViewState::Approaching);
}
