//! A study on an arm behind FRI, in real time on loopback: a simulated controller, and a hand that comes over a WebSocket.

use crate::alone;
use anyhow::{Context, ensure};
use hwall::glam::DVec3;
use hwall::haptics::Board;
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::sim::{HandContact, ServoArm, ServoConfig, minimum_jerk};
use hwall_fri::FriVersion;
use hwall_fri::controller::{Controller, ControllerConfig, LinkConfig, UdpController};
use hwall_lab::touch_study::arm::{ArmArgs, LedArm, WaitingArm};
use hwall_lab::touch_study::people;
use hwall_lab::touch_study::settings::ProtocolArgs;
use hwall_study::{
    Answer, ArmKind, Ask, Durability, Fault, Presenter, Respondent, Stimulus, Study, StudyError,
    conduct,
};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::Message;

const TARGET_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);
const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);
/// When the hand leaves its rest, presses, lets go, is back, and begins again, s.
const TIMES_S: [f64; 5] = [1.0, 2.6, 3.7, 4.0, 5.0];
const SLIDE_M_PER_S: f64 = 0.062;
const LOOPBACK: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);
/// The longest that the controller may take to begin, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A hand that touches the wall again and again, and what it touches.
#[derive(Clone)]
struct World {
    began: Instant,
    ends: Arc<AtomicBool>,
    /// The controller falls silent.
    silent: Arc<AtomicBool>,
    /// The page holds the enabling switch.
    enables: Arc<AtomicBool>,
    /// The way of the board so far, um.
    moved_um: Arc<AtomicU64>,
}

impl World {
    fn begin() -> Self {
        Self {
            began: Instant::now(),
            ends: Arc::default(),
            silent: Arc::default(),
            enables: Arc::default(),
            moved_um: Arc::default(),
        }
    }

    fn moved_m(&self) -> f64 {
        1e-6 * self.moved_um.load(Ordering::Relaxed) as f64
    }

    fn now_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    fn tip_m(t_s: f64) -> DVec3 {
        let t_s = t_s % TIMES_S[4];
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(TIMES_S[0], TIMES_S[1]) - share(TIMES_S[2], TIMES_S[3]);
        let slid_s = t_s.clamp(TIMES_S[1], TIMES_S[2]) - TIMES_S[1];
        let inside_m = TARGET_M - 0.015 * DVec3::X + SLIDE_M_PER_S * slid_s * DVec3::Y;
        (TARGET_M + REST_M).lerp(inside_m, out)
    }

    /// The controller of the arm that the hand presses.
    fn controller(&self, client: SocketAddr) -> anyhow::Result<JoinHandle<()>> {
        let tool = Board::default().flange_from_board_face()?;
        let model = Arc::new(SrsArm::iiwa7().with_tool(tool));
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let plant = ServoArm::new(model, start, ServoConfig::default())?;
        let config = ControllerConfig {
            version: FriVersion::V1_15,
            send_period_ms: 5,
            ready_s: Some(0.1),
            ..ControllerConfig::default()
        };
        let controller = Controller::new(plant, config)?;
        let mut udp = UdpController::bind(controller, LOOPBACK, client, LinkConfig::default())?;
        let (world, finger) = (self.clone(), HandContact::default());
        Ok(std::thread::spawn(move || {
            let (mut last_m, mut way_m) = (None, 0.0);
            let ended = udp.run(|controller| {
                let t_s = world.now_s();
                let plant = controller.plant_mut();
                let at_m = plant.pose().position_m();
                way_m += at_m.distance(last_m.replace(at_m).unwrap_or(at_m));
                world
                    .moved_um
                    .store((1e6 * way_m) as u64, Ordering::Relaxed);
                let velocity = (Self::tip_m(t_s + 1e-5) - Self::tip_m(t_s - 1e-5)) / 2e-5;
                let relative = velocity - plant.twist().linear_m_per_s;
                let wrench = finger.wrench(&plant.pose(), Self::tip_m(t_s), relative);
                // A wrench of finite numbers is never refused.
                let _ = plant.apply_wrench(wrench.ok().flatten().unwrap_or_default());
                if world.silent.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_secs(2));
                    return false;
                }
                !world.ends.load(Ordering::Relaxed)
            });
            drop(ended);
        }))
    }

    /// The page that sees the hand.
    fn page(&self, server: SocketAddr) -> anyhow::Result<JoinHandle<()>> {
        let stream = TcpStream::connect(server)?;
        stream.set_nodelay(true)?;
        let (mut socket, _) = tungstenite::client(format!("ws://{server}/ws"), stream)?;
        socket.get_mut().set_nonblocking(true)?;
        let world = self.clone();
        Ok(std::thread::spawn(move || {
            let mut seq = 0;
            while !world.ends.load(Ordering::Relaxed) {
                seq += 1;
                // A server that hung up is seen by the study.
                let _ = socket.send(Message::text(hand(seq, world.now_s())));
                let is_held = world.enables.load(Ordering::Relaxed);
                let orders = [(is_held, "enable"), (seq % 90 == 0, "release")];
                for (_, order) in orders.iter().filter(|(is, _)| *is) {
                    let _ = socket.send(Message::text(format!(r#"{{"type":"{order}"}}"#)));
                }
                while socket.read().is_ok() {}
                std::thread::sleep(Duration::from_millis(11));
            }
        }))
    }
}

/// A sample of the right hand, in the arm's base frame.
fn hand(seq: u64, t_s: f64) -> String {
    let tip_m = World::tip_m(t_s);
    let joint = |index: usize| {
        let off_m = match index {
            10 => 0.0,
            5 | 15 | 20 | 25 => 0.05,
            _ => 0.15,
        };
        let [x, y, z] = (tip_m + off_m * DVec3::X).to_array();
        format!("[{x},{y},{z}]")
    };
    let joints: Vec<String> = (0..26).map(joint).collect();
    let head_m = TARGET_M + DVec3::new(0.7, -0.1, 0.4);
    let gaze = TARGET_M + 0.03 * DVec3::Y - head_m;
    format!(
        r#"{{"type":"hand","seq":{seq},"client_ms":{},"side":"right","joints":[{}],"head":[{},{},{},0,0,0,1],"gaze":[{},{},{}],"axes":"base"}}"#,
        1e3 * t_s,
        joints.join(","),
        head_m.x,
        head_m.y,
        head_m.z,
        gaze.x,
        gaze.y,
        gaze.z
    )
}

/// Answers so many questions and then leaves.
struct Answers(usize);

impl Respondent for Answers {
    fn tell(&mut self, _: &str) -> Result<(), StudyError> {
        Ok(())
    }

    fn ask(&mut self, _: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        if let Ask::Procedure(_) = ask {
            if self.0 == 0 {
                return Ok(None);
            }
            self.0 -= 1;
        }
        Ok(Some(Answer {
            value: 2.0,
            answered_s: 0.5,
        }))
    }
}

#[test]
fn three_conditions_on_an_arm_behind_fri_and_a_controller_that_goes_away() -> anyhow::Result<()> {
    let _alone = alone();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("study-over-fri");
    let _ = std::fs::remove_dir_all(&folder);
    let flags = ProtocolArgs {
        factors: vec!["angle".to_owned()],
        levels: vec!["0,45,90".to_owned()],
        practice: Some(0),
        catch_per_block: Some(0),
        ..ProtocolArgs::default()
    };
    let open = || people::open(ArmKind::Fri, &folder, Some(1), &flags);
    let mut study = open()?;
    let waiting = WaitingArm::prepare(&options(&[]), study.protocol())?;
    let world = World::begin();
    let page = world.page(waiting.server.address())?;
    let controller = world.controller(waiting.fri_address()?)?;
    let mut arm = waiting.connect(PATIENCE)?;

    // One answer, a cut in the middle of the log's last line, and on.
    let answered = conduct(&mut study, &mut arm.stage, &mut Answers(1))?;
    ensure!(answered == 1, "{answered} {:?}", study.trials());
    drop(study);
    let path = Study::log_path(&folder);
    let log = std::fs::read(&path)?;
    std::fs::write(&path, log.get(..log.len() - 9).context("a log")?)?;
    let first = String::from_utf8_lossy(&log);
    ensure!(
        first
            .lines()
            .next()
            .is_some_and(|l| l.contains("\"arm\":\"fri\""))
    );
    // The simulated arm does not go on with it.
    let refused = people::open(ArmKind::Simulated, &folder, None, &flags)
        .err()
        .context("refused")?;
    ensure!(
        format!("{refused:#}").contains("on an arm behind FRI"),
        "{refused:#}"
    );
    let mut study = open()?;
    conduct(&mut study, &mut arm.stage, &mut Answers(9))?;
    let record = study.record();
    for trial in &record.trials {
        println!(
            "{:?} {:?} {:?}",
            trial.wanted, trial.shown.rendered, trial.why_not
        );
    }
    let valid: Vec<_> = record.trials.iter().filter(|t| t.is_valid()).collect();
    ensure!(record.done && valid.len() == 3, "{record:?}");
    for trial in valid {
        let (wanted, shown) = (trial.wanted, trial.shown.rendered);
        let angle_deg = shown.angle_deg.context("felt")?;
        let speed_mm_per_s = shown.speed_mm_per_s.context("felt")?;
        ensure!((angle_deg - wanted.angle_deg).abs() < 6.0, "{shown:?}");
        ensure!(
            (speed_mm_per_s - wanted.speed_mm_per_s).abs() < 10.0,
            "{shown:?}"
        );
        ensure!(
            shown.force_n.is_some_and(|n| n > 2.0) && shown.contact_s > 0.4,
            "{shown:?}"
        );
    }

    goes_away(&world, &mut arm)?;
    world.ends.store(true, Ordering::Relaxed);
    drop(arm);
    ensure!(page.join().is_ok() && controller.join().is_ok());
    Study::resume(&folder, Durability::System)
        .err()
        .context("the study is in use")?;
    Ok(())
}

fn options(more: &[&str]) -> ArmArgs {
    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        arm: ArmArgs,
    }
    let loopback = LOOPBACK.to_string();
    let own = [
        "study", "--fri", &loopback, "--hands", &loopback, "--origin", "0,0,0,0",
    ];
    <Line as clap::Parser>::parse_from([&own[..], more].concat()).arm
}

/// The switch is held by the page that brings the hand, and each second somebody asks for the arm to be let go.
#[test]
fn the_arm_of_a_study_moves_only_while_the_switch_is_held() -> anyhow::Result<()> {
    let _alone = alone();
    let options = options(&["--enabling-switch"]);
    let waiting = WaitingArm::prepare(&options, &ProtocolArgs::default().protocol(Some(1))?)?;
    let world = World::begin();
    let page = world.page(waiting.server.address())?;
    let controller = world.controller(waiting.fri_address()?)?;
    let arm = waiting.connect(PATIENCE)?;
    let moved_m = |for_s: f64| {
        let before_m = world.moved_m();
        std::thread::sleep(Duration::from_secs_f64(for_s));
        world.moved_m() - before_m
    };
    let before_m = moved_m(6.0);
    world.enables.store(true, Ordering::Relaxed);
    let held_m = moved_m(10.0);
    world.enables.store(false, Ordering::Relaxed);
    let braking_m = moved_m(1.0);
    let after_m = moved_m(6.0);
    println!("{before_m} m, held {held_m} m, then {braking_m} m and {after_m} m");
    world.ends.store(true, Ordering::Relaxed);
    drop(arm);
    ensure!(page.join().is_ok() && controller.join().is_ok());
    ensure!(before_m < 1e-3 && after_m < 1e-3 && held_m > 0.1);
    Ok(())
}

/// The trial under way is spoilt, the next one refused, and the session's state has a name.
fn goes_away(world: &World, arm: &mut LedArm) -> anyhow::Result<()> {
    let silent = Arc::clone(&world.silent);
    let falls = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        silent.store(true, Ordering::Relaxed);
    });
    let shown = arm.stage.present(&Stimulus::default(), 1)?;
    let because = arm.stage.because().unwrap_or_default();
    println!("{because}");
    ensure!(shown.fault == Fault::ArmGone, "{shown:?} {because}");
    ensure!(because.contains("(stopped: requested)"), "{because}");
    let refused = arm.stage.present(&Stimulus::default(), 2);
    ensure!(
        matches!(refused, Err(StudyError::ArmEnded { .. })),
        "{refused:?}"
    );
    ensure!(falls.join().is_ok());
    Ok(())
}
