//! A client over loopback.
#![allow(dead_code, reason = "benches use a part")]

use hwall::glam::DVec3;
use hwall::haptics::Board;
use hwall::kinematics::SrsArm;
use hwall::scene::Scene;
use hwall_bridge::view::ViewScene;
use hwall_bridge::{BridgeConfig, BridgeServer};
use serde_json::Value;
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Longer than any operation takes, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A wall 0.62 m ahead of an iiwa.
pub(crate) fn wall() -> Scene {
    let obj = "o wall\nv 0.62 -1 0\nv 0.62 1 0\nv 0.62 1 1.5\nv 0.62 -1 1.5\nf 1 2 3 4\n";
    Scene::from_obj_str(obj, None).expect("a scene").0
}

/// The same as a view.
pub(crate) fn scene() -> ViewScene {
    let board = Board::default();
    let tool = board.flange_from_board_face().expect("a board");
    let arm = SrsArm::iiwa7().with_tool(tool);
    ViewScene::new("a wall", &wall(), &arm, &board).expect("a scene to look at")
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
        let stream = TcpStream::connect(server.address()).expect("a connection");
        stream.set_nodelay(true).expect("a socket");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let address = format!("ws://{}{path}", server.address());
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
