//! However a person stops the arm, its command stands within 20 ms of simulated time after the message has arrived.

use crate::common::{DT_S, TRACKER_S, wall};
use glam::DVec3;
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{Arm, ArmCommand, Board};
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::{Controller, Cycle, Session, SessionConfig, maps_of};
use hwall_bridge::{Bridge, BridgeConfig, BridgeServer};
use hwall_record::Recorded;
use hwall_sim::{ServoArm, ServoConfig};
use hwall_stage::live::{Holds, after, heed_console};
use hwall_view::ViewScene;
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::Duration;
use tungstenite::{Message, WebSocket};

/// Longest time from the arrival of a stop to a command that stands, s.
const STANDS_S: f64 = 0.02;

/// The loop of `bridge`, one cycle after the other.
struct Loop {
    server: BridgeServer,
    bridge: Bridge,
    recorded: Recorded<'static, DeterministicPredictor>,
    servo: ServoArm,
    holds: Holds,
    cycles: usize,
    frames: usize,
}

impl Loop {
    fn new() -> Self {
        let board = Board::default();
        let model = SrsArm::iiwa7().with_tool(board.flange_from_board_face().unwrap());
        let (scene, config) = (wall(0.62), DeterministicConfig::ray_led());
        let maps = maps_of(&scene, &model).unwrap();
        let predictor = DeterministicPredictor::new(config).unwrap();
        let config = SessionConfig {
            hand: HandFilterConfig::simulated(),
            ..SessionConfig::default()
        };
        let session = Session::new(&model, &board, scene, maps, predictor, config).unwrap();
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let model = session.control().arm().clone();
        let server = BridgeServer::start(BridgeConfig {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            ..BridgeConfig::default()
        });
        let server = server.unwrap();
        Self {
            bridge: server.connect(&ViewScene::of("a wall", &session).unwrap()),
            server,
            recorded: Recorded {
                session,
                recorder: None,
            },
            servo: ServoArm::new(model, start, ServoConfig::default()).unwrap(),
            holds: Holds::default(),
            cycles: 0,
            frames: 0,
        }
    }

    /// A hand before the wall that goes from one side to the other.
    fn frame(t_s: f64) -> HandFrame {
        let y = 0.25 * (std::f64::consts::TAU * t_s / 2.0).sin();
        let tip_m = DVec3::new(0.75, y, 0.6);
        let head_m = DVec3::new(1.4, -0.2, 1.1);
        HandFrame {
            palm_m: Some(tip_m + DVec3::X * 0.1),
            tips_m: [None, Some(tip_m), None, None, None],
            head_m: Some(head_m),
            gaze: (tip_m - head_m).try_normalize(),
            ..HandFrame::empty(t_s)
        }
    }

    fn cycle(&mut self) -> ArmCommand {
        let t_s = self.cycles as f64 * DT_S;
        self.cycles += 1;
        while self.frames as f64 * TRACKER_S <= t_s {
            let frame = Self::frame(self.frames as f64 * TRACKER_S);
            self.recorded.frame(&frame);
            self.frames += 1;
        }
        let state = self.servo.state().unwrap();
        let command = self.recorded.step(t_s, &state);
        self.servo.command(command).unwrap();
        self.recorded.plan();
        self.servo.advance(DT_S).unwrap();
        let cycle = Cycle {
            t_s,
            state,
            command,
        };
        let (bridge, holds) = (&mut self.bridge, &mut self.holds);
        after(bridge, holds, &mut self.recorded, &cycle, false);
        command
    }

    fn speed_m_per_s(&self) -> f64 {
        self.servo.twist().linear_m_per_s.length()
    }
}

/// A page of the server.
fn page(server: &BridgeServer) -> WebSocket<TcpStream> {
    let stream = TcpStream::connect(server.address()).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    let address = format!("ws://{}/ws", server.address());
    tungstenite::client(address, stream).unwrap().0
}

/// Sends a stop, and returns once the server has taken it: it answers in order.
fn stops(page: &mut WebSocket<TcpStream>) {
    for message in [
        r#"{"type":"stop"}"#,
        r#"{"type":"ping","id":1,"client_ms":0}"#,
    ] {
        page.send(Message::text(message)).unwrap();
    }
    let is_pong =
        |message: &Message| matches!(message, Message::Text(text) if text.contains("pong"));
    while !is_pong(&page.read().unwrap()) {}
}

#[test]
fn a_stop_stands_within_20_ms_of_its_arrival() {
    type Stop = fn(&Loop, &mut [WebSocket<TcpStream>; 2]);
    let ways: [(&str, Stop); 3] = [
        ("key s of the page", |_, [first, _]| stops(first)),
        ("a second device", |_, [_, second]| stops(second)),
        ("key s of the console", |run, _| {
            heed_console(&run.bridge.view.orders(), &b"s\n"[..]);
        }),
    ];
    for (name, stop) in ways {
        let mut run = Loop::new();
        let mut pages = [page(&run.server), page(&run.server)];
        while run.speed_m_per_s() < 0.3 {
            assert!(run.cycles < 10_000, "the arm never moves");
            run.cycle();
        }
        stop(&run, &mut pages);
        let commands: Vec<_> = (0..500).map(|_| run.cycle()).collect();
        let moving = commands.iter().take_while(|c| **c != ArmCommand::Hold);
        let moving = moving.count();
        println!("{name}: stands after {moving} cycles");
        let stands_s = (moving + 1) as f64 * DT_S;
        assert!(stands_s <= STANDS_S, "{name}: {stands_s} s");
        let stands = commands[moving..].iter().all(|c| *c == ArmCommand::Hold);
        assert!(stands && run.speed_m_per_s() < 1e-3, "{name}");
        assert!(run.recorded.session.control().is_latched(), "{name}");
    }
}
