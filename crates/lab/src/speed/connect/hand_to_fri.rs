//! From a frame of the hand to the datagram that moves the arm, over loopback.

use super::session;
use anyhow::{Context, anyhow};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::{Surroundings, drive};
use hwall_bridge::{Bridge, BridgeConfig, BridgeServer};
use hwall_fri::controller::{
    Controller, ControllerConfig, LinkConfig, QualityConfig, UdpController, iiwa7_servo,
};
use hwall_fri::{FriClient, FriClientConfig, FriError};
use hwall_scene::Scene;
use hwall_sim::ServoArm;
use hwall_stage::input::arms::BoardArm;
use hwall_testkit::Timing;
use hwall_view::ViewScene;
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Rate of the headset, Hz.
pub(super) const HEADSET_HZ: f64 = 72.0;
const TIMEOUT: Duration = Duration::from_secs(10);
const WALL: &str = "o wall\nv 0.62 -1 0\nv 0.62 1 0\nv 0.62 1 1.5\nv 0.62 -1 1.5\nf 1 2 3 4\n";

/// What came of the frames that were sent.
pub(super) struct HandToFri {
    /// From before a frame is written to the socket until the command that answers it has been sent.
    pub(super) timing: Timing,
    /// Frames that were answered.
    pub(super) answered: usize,
    /// Messages of the controller that got no answer in time.
    pub(super) missed: u64,
    /// All messages that expected one.
    pub(super) expected: u64,
}

/// A client that says when it sent its last command.
struct Timed {
    client: FriClient,
    command_at: Instant,
}

impl Arm for Timed {
    type Error = FriError;

    fn state(&mut self) -> Result<ArmState, FriError> {
        self.client.state()
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), FriError> {
        let done = self.client.command(command);
        self.command_at = Instant::now();
        done
    }
}

/// The arm's clock, and which frames were taken: a hand's place along y is its number.
struct Numbered {
    bridge: Bridge,
    unanswered: Option<f64>,
    taken: Vec<usize>,
}

impl Surroundings<Timed> for Numbered {
    fn next_cycle(&mut self, arm: &mut Timed) -> Result<Option<f64>, FriError> {
        if self.bridge.view.is_stopped() {
            return Ok(None);
        }
        let now_s = match self.unanswered.take() {
            Some(now_s) => now_s,
            None => arm.client.wait_for_message(TIMEOUT)?,
        };
        Ok(Some(now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let frame = self.bridge.hands.next_frame(now_s)?;
        if let Some(palm_m) = frame.palm_m {
            self.taken.push((palm_m.y * 1e6).round() as usize);
        }
        Some(frame)
    }
}

fn any_port() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::LOCALHOST, 0))
}

/// The controller; a busy machine is no reason for it to end commanding.
fn controller(plant: ServoArm) -> anyhow::Result<Controller<ServoArm>> {
    let config = ControllerConfig {
        ready_s: Some(0.1),
        command_expiry_s: 5.0,
        quality: QualityConfig {
            window: 100,
            least: 20,
            fair: 0.01,
            good: 0.02,
            excellent: 0.95,
        },
        ..ControllerConfig::default()
    };
    Ok(Controller::new(plant, config)?)
}

/// Sends a hand so often that `frames` samples are through, and says when each was.
fn send_hands(address: &str, frames: usize) -> anyhow::Result<Vec<Instant>> {
    let stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let (mut socket, _) = tungstenite::client(format!("ws://{address}/ws"), stream)
        .map_err(|error| anyhow!("{error}"))?;
    let began = Instant::now();
    let mut sent = Vec::with_capacity(frames);
    for number in 0..frames {
        let due = Duration::from_secs_f64(number as f64 / HEADSET_HZ);
        thread::sleep(due.saturating_sub(began.elapsed()));
        let place = DVec3::new(1.0, 1e-6 * number as f64, 0.5);
        let joint = format!("[{},{},{}]", place.x, place.y, place.z);
        let joints = vec![joint; 25].join(",");
        let client_ms = 1e3 * began.elapsed().as_secs_f64();
        let text = format!(
            r#"{{"type":"hand","seq":{},"client_ms":{client_ms},"side":"right","joints":[{joints}],"head":null,"gaze":null,"axes":"base","source":"measurement"}}"#,
            number + 1
        );
        sent.push(Instant::now());
        socket.send(Message::text(text))?;
    }
    thread::sleep(Duration::from_millis(200));
    Ok(sent)
}

/// Hands come in by WebSocket 72 times a second, a session leads a simulated controller at 1 kHz.
///
/// # Errors
/// A port that cannot be had; a controller that ends commanding.
pub(super) fn measure(seed: u64, frames: usize) -> anyhow::Result<HandToFri> {
    let server = BridgeServer::start(BridgeConfig {
        listen: any_port(),
        ..BridgeConfig::default()
    })?;
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let (scene, _) = Scene::from_obj_str(WALL, None)?;
    let mut session = session::ray_led(&arm, &board, scene)?;
    let config = FriClientConfig {
        listen: any_port(),
        ..FriClientConfig::default()
    };
    let client = FriClient::bind(session.control().arm(), config)?;
    let to = client.local_address()?;
    let plant = controller(iiwa7_servo(seed)?)?;
    let mut udp = UdpController::bind(plant, any_port(), to, LinkConfig::default())?;
    let mut timed = Timed {
        client,
        command_at: Instant::now(),
    };
    let (is_over, stop) = (AtomicBool::new(false), server.stop_handle());
    let address = server.address().to_string();
    let mut answered = Vec::with_capacity(frames);
    let sent = thread::scope(|scope| {
        let moving = scope.spawn(|| udp.run(|_| !is_over.load(Ordering::Relaxed)));
        let led = timed.client.wait_for_commanding(TIMEOUT).and_then(|began| {
            let view = ViewScene::of("a wall", &session);
            // A scene that a session is made of can be shown.
            let Ok(view) = view else { return Ok(None) };
            let mut room = Numbered {
                bridge: server.connect(&view),
                unanswered: Some(began),
                taken: Vec::with_capacity(64),
            };
            let hands = scope.spawn(|| {
                let sent = send_hands(&address, frames);
                stop.stop();
                sent
            });
            drive(
                &mut session,
                &mut timed,
                &mut room,
                |session, timed, Numbered { bridge, taken, .. }, cycle| {
                    answered.extend(taken.drain(..).map(|number| (number, timed.command_at)));
                    bridge.show(session, &cycle.state);
                    Ok(())
                },
            )?;
            Ok(Some(hands))
        });
        is_over.store(true, Ordering::Relaxed);
        let run = moving.join();
        run.map_err(|_| anyhow!("the controller's thread failed"))??;
        let hands = led?.context("a wall that can be shown")?.join();
        hands.map_err(|_| anyhow!("the hand's thread failed"))?
    })?;
    let took_ns = |(number, at): &(usize, Instant)| {
        let since = at.duration_since(*sent.get(*number)?);
        Some(1e9 * since.as_secs_f64())
    };
    let took_ns: Vec<f64> = answered.iter().filter_map(took_ns).collect();
    let statistics = udp.controller().statistics();
    anyhow::ensure!(!took_ns.is_empty(), "no frame was answered");
    Ok(HandToFri {
        answered: took_ns.len(),
        timing: Timing::from_samples_ns(took_ns),
        missed: statistics.missed,
        expected: statistics.expected,
    })
}
