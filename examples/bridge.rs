//! Hands from a headset's browser or a mouse, a live view of the simulated iiwa in any browser.
//!
//! `cargo run --release --example bridge`

use anyhow::Context;
use clap::Parser;
use hwall::geometry::Pose;
use hwall_bridge::{BridgeConfig, BridgeServer, UnityConfig};
use hwall_fri::{FriClientConfig, FriVersion};
use hwall_stage::input::address::{host, socket_address};
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::live::{self, HandChoice, LiveArm, LiveOptions};
use hwall_stage::numbers::positive;
use hwall_stage::person::predictors::PredictorKind;
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_stage::{exit, note};
use std::io::{self, Write};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Serves a page on which a mouse, a finger or the hands in a headset touch the walls of a room, and a simulated arm
/// brings its board there.
///
/// Prints the address; ends on Ctrl-C.
#[derive(Parser)]
struct Args {
    /// Where to listen; another address than 127.0.0.1 lets other machines in
    #[arg(long, default_value = "127.0.0.1:8080", value_parser = socket_address)]
    listen: SocketAddr,
    /// Name of a proxy by which browsers reach the page; may be given more than once
    #[arg(long = "host")]
    hosts: Vec<String>,
    /// OBJ scene, z up, metres, in the frame of the arm's base [default: the built-in room]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Origin of the headset's space in the arm's base frame: x,y,z in metres, yaw in degrees. A headset's space lies on the floor; in the built-in room that is 0.6 m below the base
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true, default_value = "1.5,0,-0.6,180")]
    origin: FloorPose,
    /// servo: joint targets with a delay, doors rendered by positions; torque: rigid bodies, friction and sensors, doors rendered by torques
    #[arg(long, value_enum, default_value_t)]
    arm_level: ArmLevel,
    /// Who leads the board [default: fused, or ray-led where there is nobody to learn from]
    #[arg(long, value_enum)]
    predictor: Option<PredictorKind>,
    /// Which hand the board serves
    #[arg(long, value_enum, default_value_t)]
    hand: HandChoice,
    /// A hand that stands quite still counts as lost: for a headset that repeats its last pose when it loses a hand
    #[arg(long)]
    watch_frozen: bool,
    /// Listens here for the FRI controller of an iiwa and leads its arm instead of a simulated one: 127.0.0.1:30200 for a simulated controller, the address of this computer towards a real one, with a port of 30200 to 30209
    #[arg(long, conflicts_with = "unity_udp", value_parser = socket_address)]
    fri: Option<SocketAddr>,
    /// Address of the controller: what comes from elsewhere is counted and dropped [default: the first one that speaks leads]
    #[arg(long, requires = "fri", value_parser = host)]
    fri_controller: Option<IpAddr>,
    /// Version of its interface: 1.15, 2.5 or 2.7
    #[arg(long, default_value = "1.15")]
    fri_version: FriVersion,
    /// Takes the dissertation's UDP datagrams here, which say where the board goes; hands are then not followed
    #[arg(long, value_parser = socket_address)]
    unity_udp: Option<SocketAddr>,
    /// Records the session to this file, for Foxglove, Rerun and `hwall --replay`; the arm's capsules as URDF beside it
    #[arg(long, conflicts_with = "unity_udp")]
    record: Option<PathBuf>,
    /// End after this many seconds [default: never]
    #[arg(long, allow_negative_numbers = true, value_parser = positive)]
    seconds: Option<f64>,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Args {
    fn options(&self) -> LiveOptions<'_> {
        LiveOptions {
            scene: self.scene.as_deref(),
            level: self.arm_level,
            predictor: self.predictor,
            watch_frozen: self.watch_frozen,
            seconds: self.seconds,
            seed: self.seed,
            record: self.record.as_deref(),
        }
    }

    fn arm(&self) -> LiveArm {
        match (self.unity_udp, self.fri) {
            (Some(listen), _) => LiveArm::Told(UnityConfig {
                listen,
                ..UnityConfig::default()
            }),
            (None, Some(listen)) => LiveArm::Fri(FriClientConfig {
                listen,
                controller: self.fri_controller,
                version: self.fri_version,
                ..FriClientConfig::default()
            }),
            (None, None) => LiveArm::Simulated,
        }
    }
}

/// The status of a program that Ctrl-C ended before it had anything to write.
const INTERRUPTED: i32 = 130;

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let options = args.options();
    let arm = args.arm();
    options.check(&arm)?;
    let server = BridgeServer::start(BridgeConfig {
        listen: args.listen,
        hosts: args.hosts.clone(),
        hand: args.hand.into(),
        base_from_headset: Pose::from_affine(&args.origin.outer_from_here())?,
        ..BridgeConfig::default()
    })?;
    let stop = server.stop_handle();
    static PREPARED: AtomicBool = AtomicBool::new(false);
    let unrecorded = args.record.clone();
    let stops = move || {
        stop.stop();
        // Nothing is under way yet that would have to be ended.
        if !PREPARED.load(Ordering::Relaxed) {
            if let Some(path) = &unrecorded {
                note(format_args!(
                    "stopped while preparing: nothing was recorded, there is no {}",
                    path.display()
                ));
                std::process::exit(INTERRUPTED);
            }
            std::process::exit(0);
        }
    };
    ctrlc::set_handler(stops).context("Ctrl-C")?;
    say(&format!("open {}", server.url()))?;
    let prepared = live::prepare(&server, &options)?;
    PREPARED.store(true, Ordering::Relaxed);
    for remark in &prepared.remarks {
        note(remark);
    }
    live::run(&server, prepared, arm, &options)?;
    say(&server.counts().to_string())
}

fn say(line: &str) -> anyhow::Result<()> {
    Ok(writeln!(io::stdout(), "{line}")?)
}
