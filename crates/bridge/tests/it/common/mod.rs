//! A client over loopback.
#![allow(dead_code, reason = "benches use a part")]

use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::glam::DVec3;
use hwall::hand::HandFilterConfig;
use hwall::haptics::Board;
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::scene::Scene;
use hwall::{Session, SessionConfig, Walls};
use hwall_bridge::view::ViewScene;
use hwall_bridge::{BridgeConfig, BridgeServer};
use hwall_sim::{ServoArm, ServoConfig};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Longer than any operation takes, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A wall 0.62 m ahead of an iiwa.
pub(crate) fn wall() -> Scene {
    let obj = "o wall\nv 0.62 -1 0\nv 0.62 1 0\nv 0.62 1 1.5\nv 0.62 -1 1.5\nf 1 2 3 4\n";
    Scene::from_obj_str(obj, None).expect("a scene").0
}

/// An iiwa that carries a board.
pub(crate) fn arm() -> (SrsArm, Board) {
    let board = Board::default();
    let tool = board.flange_from_board_face().expect("a board");
    (SrsArm::iiwa7().with_tool(tool), board)
}

/// The same as a view.
pub(crate) fn scene() -> ViewScene {
    let (arm, board) = arm();
    ViewScene::new("a wall", &wall(), &arm, &board).expect("a scene to look at")
}

/// A session in front of the wall, for a hand without tremor, and its simulated arm.
pub(crate) fn session() -> (Session<DeterministicPredictor>, ServoArm) {
    let (arm, board) = arm();
    let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led());
    let walls = Walls {
        waiting: Some(start),
        ..Walls::default()
    };
    let config = SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    let predictor = predictor.expect("a predictor");
    let session = Session::new(&arm, &board, wall(), walls, predictor, config).expect("a session");
    let model = Arc::clone(session.control().arm());
    let servo = ServoArm::new(model, start, ServoConfig::default()).expect("an arm");
    (session, servo)
}

/// A server at a free port of this machine.
pub(crate) fn server(config: BridgeConfig) -> BridgeServer {
    BridgeServer::start(BridgeConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        ..config
    })
    .expect("a server")
}

/// Polls until there is an answer.
pub(crate) fn until<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(began.elapsed() < PATIENCE, "never came: {what}");
    }
}

/// Waits until a condition holds.
pub(crate) fn wait_for(what: &str, mut is: impl FnMut() -> bool) {
    until(what, || {
        std::thread::sleep(Duration::from_millis(1));
        is().then_some(())
    });
}

/// Joints of a hand, all at one point.
pub(crate) fn joints(count: usize, [x, y, z]: [f64; 3]) -> String {
    format!("[{}]", vec![format!("[{x},{y},{z}]"); count].join(","))
}

/// A sample of a right hand.
pub(crate) fn hand(seq: u64, client_ms: f64, joints: &str, axes: &str) -> String {
    format!(
        r#"{{"type":"hand","seq":{seq},"client_ms":{client_ms},"side":"right","joints":{joints},"head":null,"gaze":null,"axes":"{axes}","source":"mouse"}}"#
    )
}

/// A hand with all points at one position, m.
pub(crate) fn hand_at(seq: u64, client_ms: f64, at_m: DVec3) -> String {
    hand(seq, client_ms, &joints(25, at_m.to_array()), "base")
}

/// The answer to bytes sent to a server; empty if it hung up without one.
pub(crate) fn answer(address: SocketAddr, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(address).expect("a connection");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    let _ = stream.write_all(request);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A field of a message, as text.
pub(crate) fn text_of<'a>(message: &'a Value, field: &str) -> &'a str {
    message[field].as_str().unwrap_or_default()
}

/// A client.
pub(crate) struct Socket(pub(crate) WebSocket<TcpStream>);

impl Socket {
    pub(crate) fn open(server: &BridgeServer) -> Self {
        Self::open_at(server, "/ws")
    }

    pub(crate) fn open_at(server: &BridgeServer, path: &str) -> Self {
        Self::connect(server.address(), path)
    }

    pub(crate) fn connect(address: SocketAddr, path: &str) -> Self {
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_nodelay(true).expect("a socket");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let address = format!("ws://{address}{path}");
        let (socket, _) = tungstenite::client(address, stream).expect("a handshake");
        Self(socket)
    }

    pub(crate) fn send(&mut self, message: Message) {
        // In some tests the server has hung up.
        let _ = self.0.send(message);
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.send(Message::text(text));
    }

    /// The next text.
    pub(crate) fn next(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.0.read().expect("a message") {
                return serde_json::from_str(&text).expect("JSON");
            }
        }
    }

    /// The next text of a type.
    pub(crate) fn wait_for(&mut self, kind: &str) -> Value {
        loop {
            let message = self.next();
            if message["type"] == kind {
                return message;
            }
        }
    }
}
