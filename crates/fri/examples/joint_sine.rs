//! Moves one joint in a sine, against a controller, real or simulated:
//! `cargo run --release -p hwall-fri --example joint_sine -- 1.15 127.0.0.1:30200 5`
//! (version, address to listen on, seconds; these are the defaults). The simulated controller is
//! `cargo run --release --example iiwa_simulator`.

use hwall_fri::{FriClient, FriClientConfig};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{ArmKinematics, SrsArm};
use std::net::{SocketAddr, ToSocketAddrs};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

const JOINT: usize = 3;
const AMPLITUDE_RAD: f64 = 0.1;
const HZ: f64 = 0.25;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: &str| arguments.next().unwrap_or_else(|| default.to_owned());
    let (version, address, seconds) = (next("1.15"), next("127.0.0.1:30200"), next("5"));
    // A name may have several addresses; the simulated controller sends to that of IPv4.
    let found = address.to_socket_addrs();
    let found = found.map_err(|error| format!("{address:?} is no HOST:PORT: {error}"))?;
    let listen = found.min_by_key(SocketAddr::is_ipv6);
    let config = FriClientConfig {
        version: version.parse()?,
        listen: listen.ok_or_else(|| format!("{address:?} has no address"))?,
        ..FriClientConfig::default()
    };
    let seconds: f64 = seconds
        .parse()
        .map_err(|_| format!("{seconds:?} is no number of seconds"))?;
    let model: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7());
    let mut arm = FriClient::bind(&model, config).map_err(|error| format!("{address}: {error}"))?;
    println!("listening on {}", arm.local_address()?);

    let began_s = arm.wait_for_commanding(Duration::from_secs(60))?;
    // Where the controller holds the arm; the measured angles differ by its servo error.
    let start = arm.interpolator().unwrap_or(arm.state()?.q);
    println!(
        "commanding joint {} from {:.3} rad",
        JOINT + 1,
        start[JOINT]
    );
    let mut t_s = began_s;
    let mut farthest_rad: f64 = 0.0;
    while t_s - began_s < seconds {
        let phase = std::f64::consts::TAU * HZ * (t_s - began_s);
        let mut q = start;
        // Begins at rest: a sine of the angle would begin with a jump in speed.
        q.0[JOINT] += AMPLITUDE_RAD * 0.5 * (1.0 - phase.cos());
        arm.command(ArmCommand::Position(q))?;
        t_s = arm.wait_for_message(Duration::from_secs(1))?;
        farthest_rad = farthest_rad.max((arm.state()?.q[JOINT] - start[JOINT]).abs());
    }
    println!("moved by {farthest_rad:.3} rad");
    println!("{}", arm.statistics());
    Ok(())
}
