//! A simulated iiwa 7 behind KUKA's Fast Robot Interface: any FRI client can move it.
//!
//! `cargo run --release --example iiwa_simulator -- --client 127.0.0.1:30200 --version 1.15`

use anyhow::{Context, ensure};
use clap::Parser;
use hwall_fri::controller::{Controller, ControllerConfig, FaultConfig, LinkConfig};
use hwall_fri::controller::{SimulatedPlant, UdpController, iiwa7_servo, iiwa7_torque};
use hwall_stage::input::address::socket_address;
use hwall_stage::note;
use hwall_stage::numbers::{positive, up_to, whole_within};
use std::io::{self, Write};
use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Simulates the controller of an iiwa 7: sends its state to an FRI client and takes the client's commands.
///
/// Prints changes of state and of quality, and what was missed, until Ctrl-C or for as long as asked. Exit status: 0 if
/// commanding was reached, 1 if not, 2 for bad arguments.
#[derive(Parser)]
struct Args {
    /// Address of the client, which is sent to
    #[arg(long, default_value = "127.0.0.1:30200", value_parser = socket_address)]
    client: SocketAddr,
    /// Address to send from; 0.0.0.0:0 for a client on another machine, 127.0.0.2:30200 for one that sends to port 30200 of its host
    #[arg(long, default_value = "127.0.0.1:0", value_parser = socket_address)]
    local: SocketAddr,
    /// Version of the interface: 1.15, 2.5 or 2.7
    #[arg(long, default_value = "1.15")]
    version: String,
    /// Time between messages, ms, 1 to 10
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = whole_within::<1, 10>)]
    period_ms: u64,
    /// An answer is expected to every so-many-th message
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = whole_within::<1, 100>)]
    receive_multiplier: u64,
    /// What is simulated: joint targets, or rigid-body dynamics
    #[arg(long, default_value = "servo", value_parser = ["servo", "torque"])]
    level: String,
    /// What the client is to command, as the application on a real controller decides; torque and wrench need --level torque
    #[arg(long, default_value = "position", value_parser = ["position", "torque", "wrench"])]
    mode: String,
    /// Share of datagrams that are lost, in each direction
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<1>)]
    loss: f64,
    /// Delay of messages to the client, ms, at most 10000
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<10_000>)]
    delay_ms: f64,
    /// Further delay, at random up to this, ms
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<10_000>)]
    jitter_ms: f64,
    /// Share of the cycles that begin a burst of one to four answers that do not arrive
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<1>)]
    bursts: f64,
    /// Share of the cycles that begin a stall of 20 to 200 ms, in which no answer arrives
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<1>)]
    stalls: f64,
    /// Time stamps are off by at most this, either way, ms, at most 50
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<50>)]
    stamp_jitter_ms: f64,
    /// Share of the cycles whose answer comes one to three cycles late
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<1>)]
    late: f64,
    /// Share of the cycles that end commanding for a while, as by a fall of the quality; it begins again by itself
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<1>)]
    leaves: f64,
    /// The robot's information has numbers that no version knows
    #[arg(long)]
    unknown_enums: bool,
    /// Time in IDLE before the session begins, ms; many clients leave at the first IDLE
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = up_to::<3_600_000>)]
    idle_ms: f64,
    /// How long to run, s; without it until Ctrl-C
    #[arg(long, allow_negative_numbers = true, value_parser = positive)]
    seconds: Option<f64>,
    /// Seed of losses, jitter and sensor noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
}

/// A client that has not answered for this long from the start is not there, s.
const NOBODY_S: f64 = 2.0;

fn main() -> ExitCode {
    match run(&hwall_stage::arguments::<Args>()) {
        // Commanding was not reached.
        Ok(false) => ExitCode::from(1),
        result => hwall_stage::exit(result.map(|_| ())),
    }
}

fn run(args: &Args) -> anyhow::Result<bool> {
    ensure!(
        args.mode == "position" || args.level == "torque",
        "--mode {} needs --level torque: only that arm takes torques",
        args.mode
    );
    match args.level.as_str() {
        "servo" => serve(args, iiwa7_servo(args.seed)?),
        _ => serve(args, iiwa7_torque(args.seed)?),
    }
}

fn serve<P: SimulatedPlant>(args: &Args, plant: P) -> anyhow::Result<bool> {
    let config = ControllerConfig {
        version: args.version.parse().context("--version")?,
        send_period_ms: args.period_ms as u32,
        receive_multiplier: args.receive_multiplier as u32,
        mode: args.mode.parse()?,
        idle_s: args.idle_ms * 1e-3,
        faults: FaultConfig {
            bursts: args.bursts,
            stalls: args.stalls,
            stamp_jitter_ms: args.stamp_jitter_ms,
            late: args.late,
            leaves: args.leaves,
            unknown_enumerations: args.unknown_enums,
            seed: args.seed,
        },
        start_unix_s: SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() as u32,
        ..ControllerConfig::default()
    };
    let link = LinkConfig {
        loss: args.loss,
        delay_s: args.delay_ms * 1e-3,
        jitter_s: args.jitter_ms * 1e-3,
        seed: args.seed,
    };
    let until_s = args.seconds.unwrap_or(f64::INFINITY);
    let controller = Controller::new(plant, config)?;
    let mut udp = UdpController::bind(controller, args.local, args.client, link)?;
    let _ = writeln!(
        io::stdout(),
        "FRI {} from {} to {}",
        config.version,
        udp.local_address()?,
        args.client
    );
    static STOP: AtomicBool = AtomicBool::new(false);
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    let mut told = false;
    udp.run(|controller| {
        print_events(controller);
        let heard = controller.statistics();
        if !told && controller.t_s() > NOBODY_S && heard.in_time + heard.late + heard.malformed == 0
        {
            told = true;
            note(format_args!(
                "nobody answers at {}: start the client first, for instance bridge --fri {0}",
                args.client
            ));
        }
        controller.t_s() < until_s && !STOP.load(Ordering::Relaxed)
    })?;
    print_events(udp.controller_mut());
    let _ = writeln!(
        io::stdout(),
        "{}\n{}",
        udp.controller().statistics(),
        udp.udp_statistics()
    );
    Ok(udp.controller().statistics().activations > 0)
}

fn print_events<P: SimulatedPlant>(controller: &mut Controller<P>) {
    while let Some(event) = controller.next_event() {
        // A controller does not stop because nobody reads what it says.
        let _ = writeln!(io::stdout(), "{:9.3} s  {}", event.t_s, event.kind);
    }
}
