//! A live session whose hand comes by WebSocket: recorded, run again, and killed in the middle.

use crate::alone;
use anyhow::{Context, ensure};
use clap::Parser;
use hwall_bridge::{BridgeConfig, BridgeServer};
use hwall_kinematics::JointPositions;
use hwall_record::{Ending, Input, Recording, Request};
use hwall_stage::input::scene_file::SceneFlags;
use hwall_stage::live::{LiveFlags, prepare, run_simulated};
use hwall_stage::recording::replay;
use std::io::{BufRead, BufReader, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Names the file of the child that is killed.
const CHILD: &str = "HWALL_LIVE_CHILD";
/// Nothing takes so long, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(120);
const OBJ: &str = "o wall\nv 0.62 -1 -0.6\nv 0.62 1 -0.6\nv 0.62 1 1.9\nv 0.62 -1 1.9\nf 1 2 3 4\n";

/// A file of this name that no other test uses.
fn file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("hwall-live-{}-{name}", std::process::id()))
}

/// Removes the recording, its URDF and its scene, also when a test fails.
struct Files([PathBuf; 3]);

impl Files {
    fn new(name: &str) -> anyhow::Result<Self> {
        let path = file(name);
        let all = ["mcap", "urdf", "obj"].map(|ending| path.with_extension(ending));
        std::fs::write(&all[2], OBJ)?;
        Ok(Self(all))
    }

    fn mcap(&self) -> &Path {
        &self.0[0]
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        for path in &self.0 {
            let _ = std::fs::remove_file(path);
        }
    }
}

fn server() -> anyhow::Result<BridgeServer> {
    Ok(BridgeServer::start(BridgeConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        ..BridgeConfig::default()
    })?)
}

/// Runs a session before the wall, as `bridge --record` does.
fn live(server: &BridgeServer, record: &Path, flags: LiveFlags) -> anyhow::Result<()> {
    let scene = record.with_extension("obj");
    let flags = LiveFlags {
        scene: SceneFlags {
            scene: Some(scene),
            ..LiveFlags::parse_from([""]).scene
        },
        seconds: Some(600.0),
        record: Some(record.to_owned()),
        ..flags
    };
    let prepared = prepare(server, &flags)?;
    run_simulated(server, prepared, &flags)
}

/// Flags of `bridge`.
fn flags(flags: &str) -> LiveFlags {
    LiveFlags::parse_from(std::iter::once("").chain(flags.split_whitespace()))
}

/// A client of the page's protocol.
struct Client {
    socket: WebSocket<TcpStream>,
    began: Instant,
    sent: u32,
    head: &'static str,
}

impl Client {
    /// Connects, and waits until there is a scene to touch.
    fn of_a_session(address: &str) -> anyhow::Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (mut socket, _) = tungstenite::client(format!("ws://{address}/ws"), stream)
            .map_err(|error| anyhow::anyhow!("{error}"))?;
        loop {
            if let Message::Text(text) = socket.read()? {
                let message: serde_json::Value = serde_json::from_str(&text)?;
                if message["type"] == "scene" {
                    break;
                }
            }
        }
        Ok(Self {
            socket,
            began: Instant::now(),
            sent: 0,
            head: "[1.3,-0.1,1.1,0,0,0,1]",
        })
    }

    /// The next of 72 samples a second: a hand that goes to the wall and back, again and again.
    fn send(&mut self) -> anyhow::Result<()> {
        let t_s = f64::from(self.sent) / 72.0;
        let due = Duration::from_secs_f64(t_s);
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
        let near = 0.5 - 0.5 * (std::f64::consts::TAU * t_s / 3.0).cos();
        let (x, y) = (1.05 - 0.44 * near, 0.15 * near);
        self.sent += 1;
        let joints = vec![format!("[{x},{y},0.6]"); 25].join(",");
        let client_ms = 1e3 * self.began.elapsed().as_secs_f64();
        let (seq, head) = (self.sent, self.head);
        self.socket.send(Message::text(format!(
            r#"{{"type":"hand","seq":{seq},"client_ms":{client_ms},"side":"right","joints":[{joints}],"head":{head},"gaze":null,"axes":"base","source":"test"}}"#
        )))?;
        Ok(())
    }

    /// The events that have come, each as its kind and its text.
    fn events(&mut self) -> anyhow::Result<Vec<String>> {
        let mut events = Vec::new();
        (self.socket.get_ref()).set_read_timeout(Some(Duration::from_millis(1)))?;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    let message: serde_json::Value = serde_json::from_str(&text)?;
                    if message["type"] == "event" {
                        events.push(format!("{}: {}", message["kind"], message["text"]));
                    }
                }
                Ok(_) => {}
                Err(tungstenite::Error::Io(error))
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    return Ok(events.iter().map(|event| event.replace('"', "")).collect());
                }
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// What a person asks of the arm.
    fn order(&mut self, order: &str) -> anyhow::Result<()> {
        let message = format!(r#"{{"type":"{order}"}}"#);
        Ok(self.socket.send(Message::text(message))?)
    }
}

/// Cycles, frames that see a hand, and whether a board moved.
fn content(recording: &Recording) -> anyhow::Result<(usize, usize, bool)> {
    let (mut cycles, mut seen, mut first, mut moved) = (0, 0, None, false);
    for input in recording.inputs() {
        match input?.1 {
            Input::Cycle(cycle) => {
                cycles += 1;
                let first = *first.get_or_insert(cycle.state.q);
                moved |= first.max_abs_difference(&cycle.state.q) > 0.05;
            }
            Input::Frame(frame) => seen += usize::from(frame.palm_m.is_some()),
            _ => {}
        }
    }
    Ok((cycles, seen, moved))
}

/// The line that a replay ends with, after the others.
fn replayed(path: &Path) -> anyhow::Result<String> {
    let mut text = Vec::new();
    replay(path, &mut text)?;
    let text = String::from_utf8(text)?;
    ensure!(text.contains("bit by bit"), "{text}");
    ensure!(!text.contains("left out"), "{text}");
    Ok(text)
}

/// The events that a client with a head is told, and after it one without, each from its third second on.
fn told_without_a_head(bridge: &str, name: &str) -> anyhow::Result<[Vec<String>; 2]> {
    let files = Files::new(name)?;
    let server = server()?;
    let (address, stop) = (server.address().to_string(), server.stop_handle());
    std::thread::scope(|scope| {
        let clients = scope.spawn(|| {
            let both = ["[1.3,-0.1,1.1,0,0,0,1]", "null"].map(|head| {
                let mut client = Client::of_a_session(&address)?;
                client.head = head;
                let mut told = Vec::new();
                while client.sent < 72 * 8 {
                    client.send()?;
                    // Until then the client before may still lead.
                    if client.sent > 72 * 2 {
                        told.extend(client.events()?);
                    }
                }
                anyhow::Ok(told)
            });
            stop.stop();
            let [first, second] = both;
            anyhow::Ok([first?, second?])
        });
        live(&server, files.mcap(), flags(bridge))?;
        clients.join().ok().context("the clients' thread")?
    })
}

/// What a client said ends with it: whoever comes then without a head is neither stopped for the head of the client before, nor served with it.
#[test]
fn a_client_without_a_head_after_one_with_a_head() -> anyhow::Result<()> {
    let _alone = alone();
    let is_served = |told: &[String]| told.iter().any(|event| event.starts_with("arrived"));
    let [first, second] = told_without_a_head("--predictor ray-led", "head")?;
    assert!(is_served(&first), "{first:?}");
    let unseen = "the head has not been tracked yet";
    assert!(
        second.iter().any(|event| event.contains(unseen)),
        "{second:?}"
    );
    assert!(!is_served(&second), "{second:?}");
    let [first, second] = told_without_a_head("--predictor ray-led --no-head", "no-head")?;
    assert!(
        is_served(&first) && is_served(&second),
        "{first:?} {second:?}"
    );
    Ok(())
}

#[test]
fn a_live_session_is_made_again_bit_by_bit() -> anyhow::Result<()> {
    let _alone = alone();
    let files = Files::new("whole")?;
    let server = server()?;
    let (address, stop) = (server.address().to_string(), server.stop_handle());
    let is_over = AtomicBool::new(false);
    let client = std::thread::scope(|scope| {
        let client = scope.spawn(|| {
            let mut client = Client::of_a_session(&address)?;
            while client.sent < 72 * 6 && !is_over.load(Ordering::Relaxed) {
                client.send()?;
            }
            stop.stop();
            anyhow::Ok(client.sent)
        });
        let run = live(&server, files.mcap(), flags(""));
        is_over.store(true, Ordering::Relaxed);
        run?;
        client.join().ok().context("the client's thread")?
    })?;
    let recording = Recording::open(files.mcap())?;
    assert_eq!(recording.ending(), Ending::Finished);
    let (cycles, seen, moved) = content(&recording)?;
    assert!(cycles > 1000 && seen > 100, "{cycles} {seen} of {client}");
    assert!(moved);
    let text = replayed(files.mcap())?;
    print!("{text}");
    Ok(())
}

/// Until 2 s nobody holds the switch, from then on somebody does and lets the arm go, after 5 s nobody does.
#[test]
fn the_arm_moves_only_while_the_switch_is_held() -> anyhow::Result<()> {
    let _alone = alone();
    let files = Files::new("switch")?;
    let server = server()?;
    let (address, stop) = (server.address().to_string(), server.stop_handle());
    std::thread::scope(|scope| {
        let client = scope.spawn(|| {
            let mut client = Client::of_a_session(&address)?;
            while client.sent < 72 * 8 {
                client.send()?;
                let is_held = (72 * 2..72 * 5).contains(&client.sent);
                if is_held {
                    client.order("enable")?;
                }
                // Before, while and after it is held: only once it is, does this mean anything.
                if client.sent % 72 == 0 {
                    client.order("release")?;
                }
            }
            stop.stop();
            anyhow::Ok(())
        });
        let switched = flags("--predictor ray-led --enabling-switch");
        live(&server, files.mcap(), switched)?;
        client.join().ok().context("the client's thread")?
    })?;
    // While the arm is stopped, without the time in which it brakes, and while it is free.
    let (mut stopped_rad, mut free_rad) = (0.0, 0.0);
    let (mut asked, mut asked_s) = (Vec::new(), f64::NAN);
    let mut last: Option<JointPositions> = None;
    for input in Recording::open(files.mcap())?.inputs() {
        match input?.1 {
            Input::Request(request @ (Request::Stop | Request::Reset)) => {
                asked.push(request);
                asked_s = f64::NAN;
            }
            Input::Cycle(cycle) => {
                let (t_s, q) = (cycle.state.t_s, cycle.state.q);
                let by_rad = last.map_or(0.0, |last| last.max_abs_difference(&q));
                last = Some(q);
                if asked_s.is_nan() {
                    asked_s = t_s;
                }
                match asked.last() {
                    Some(Request::Reset) => free_rad += by_rad,
                    _ if asked.len() < 2 || t_s > asked_s + 0.5 => stopped_rad += by_rad,
                    _ => {}
                }
            }
            _ => {}
        }
    }
    assert_eq!(asked.first(), Some(&Request::Stop));
    assert_eq!(asked.last(), Some(&Request::Stop));
    assert!(
        stopped_rad < 1e-3 && free_rad > 0.05,
        "{stopped_rad} {free_rad} {asked:?}"
    );
    replayed(files.mcap())?;
    Ok(())
}

#[test]
#[ignore = "the child that another test kills"]
fn a_child_that_records_until_it_is_killed() -> anyhow::Result<()> {
    let Some(record) = std::env::var_os(CHILD) else {
        return Ok(());
    };
    let server = server()?;
    println!("\nlistens at {}", server.address());
    live(&server, Path::new(&record), flags("--predictor ray-led"))
}

#[test]
fn a_session_that_is_killed_leaves_a_recording() -> anyhow::Result<()> {
    let _alone = alone();
    let files = Files::new("killed")?;
    let mut child = Command::new(std::env::current_exe()?)
        .args([
            "live_recording::a_child_that_records_until_it_is_killed",
            "--exact",
        ])
        .args(["--ignored", "--nocapture"])
        .env(CHILD, files.mcap())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()?;
    let killed = (|| {
        let lines = BufReader::new(child.stdout.take().context("its output")?).lines();
        let address = lines
            .map_while(Result::ok)
            .find_map(|line| Some(line.strip_prefix("listens at ")?.to_owned()))
            .context("an address")?;
        let mut client = Client::of_a_session(&address)?;
        let began = Instant::now();
        loop {
            for _ in 0..36 {
                client.send()?;
            }
            // Also while it is being written, the file opens.
            let (cycles, seen, moved) = content(&Recording::open(files.mcap())?)?;
            if cycles > 1000 && seen > 50 && moved {
                break anyhow::Ok(());
            }
            ensure!(began.elapsed() < PATIENCE, "{cycles} cycles, {seen} frames");
        }
    })();
    // SIGKILL on Unix: nothing is tidied up.
    child.kill()?;
    child.wait()?;
    killed?;
    let recording = Recording::open(files.mcap())?;
    assert_ne!(recording.ending(), Ending::Finished);
    let text = replayed(files.mcap())?;
    assert!(
        text.contains("not finished") || text.contains("cut"),
        "{text}"
    );
    Ok(())
}
