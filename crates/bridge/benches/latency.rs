//! Latency from a hand frame to the command that answers it, over loopback: `cargo bench -p hwall-bridge`.
//!
//! A client sends a hand 72 times a second by WebSocket; a session on the simulated arm reads it in a loop of 1 kHz. The measured time
//! starts before the frame is written to the socket and ends when the arm gets the command of the cycle that read the frame. Up to one
//! period of the loop is the wait for the next cycle; the rest is due to the network and the scheduler.

#[path = "../tests/it/common/mod.rs"]
mod common;

use common::{Socket, hand_at, scene, server, session};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmCommand, ArmState};
use hwall::{Surroundings, drive};
use hwall_bridge::{Bridge, BridgeConfig};
use hwall_sim::{ServoArm, SimError};
use std::time::{Duration, Instant};

const FRAMES: usize = 72 * 20;

/// The simulated arm, and the time of its last command.
struct Timed {
    arm: ServoArm,
    command_at: Instant,
}

impl Arm for Timed {
    type Error = SimError;

    fn state(&mut self) -> Result<ArmState, SimError> {
        self.arm.state()
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), SimError> {
        self.command_at = Instant::now();
        self.arm.command(command)
    }
}

/// A bridge that records which frame it returned last: the y coordinate of the hand is the frame number.
struct Numbered {
    bridge: Bridge,
    taken: Vec<usize>,
}

impl Surroundings<Timed> for Numbered {
    fn next_cycle(&mut self, arm: &mut Timed) -> Result<Option<f64>, SimError> {
        self.bridge.next_cycle(arm)
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let frame = self.bridge.hands.next_frame(now_s)?;
        if let Some(palm_m) = frame.palm_m {
            self.taken.push((palm_m.y * 1e6).round() as usize);
        }
        Some(frame)
    }
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * (sorted.len().max(1) - 1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let server = server(BridgeConfig::default());
    let (mut session, arm) = session();
    let mut timed = Timed {
        arm,
        command_at: Instant::now(),
    };
    let mut surroundings = Numbered {
        bridge: server.connect(&scene()),
        taken: Vec::with_capacity(64),
    };
    let stop = server.stop_handle();
    let mut socket = Socket::open(&server);
    let client = std::thread::spawn(move || {
        let began = Instant::now();
        let mut sent = Vec::with_capacity(FRAMES);
        for number in 0..FRAMES {
            let due = Duration::from_secs_f64(number as f64 / 72.0);
            std::thread::sleep(due.saturating_sub(began.elapsed()));
            let place = DVec3::new(1.0, 1e-6 * number as f64, 0.5);
            let client_ms = 1e3 * began.elapsed().as_secs_f64();
            let text = hand_at(number as u64 + 1, client_ms, place);
            sent.push(Instant::now());
            socket.text(&text);
        }
        std::thread::sleep(Duration::from_millis(200));
        stop.stop();
        sent
    });
    let mut answered = Vec::with_capacity(FRAMES);
    let mut late_ms = Vec::with_capacity(60_000);
    let mut last: Option<Instant> = None;
    drive(
        &mut session,
        &mut timed,
        &mut surroundings,
        |session, timed, Numbered { bridge, taken }, cycle| {
            answered.extend(taken.drain(..).map(|number| (number, timed.command_at)));
            if let Some(last) = last.replace(timed.command_at) {
                late_ms.push(1e3 * timed.command_at.duration_since(last).as_secs_f64() - 1.0);
            }
            bridge.show(session, &cycle.state);
            timed.arm.advance(bridge.pacing.period_s())
        },
    )?;
    let sent = client.join().map_err(|_| "the client failed")?;
    let mut ms: Vec<f64> = answered
        .iter()
        .filter_map(|(number, at)| Some(1e3 * at.duration_since(*sent.get(*number)?).as_secs_f64()))
        .collect();
    ms.sort_by(f64::total_cmp);
    late_ms.sort_by(f64::total_cmp);
    let counts = server.counts();
    println!(
        "hand to command over loopback, 72 Hz in, 1 kHz out, {} of {FRAMES} frames",
        ms.len()
    );
    println!("| what | median ms | p95 ms | p99 ms | largest ms |");
    println!("| --- | --- | --- | --- | --- |");
    for (what, sorted) in [
        ("hand to command", &ms),
        ("period of the loop beyond 1 ms", &late_ms),
    ] {
        println!(
            "| {what} | {:.2} | {:.2} | {:.2} | {:.2} |",
            quantile(sorted, 0.5),
            quantile(sorted, 0.95),
            quantile(sorted, 0.99),
            quantile(sorted, 1.0)
        );
    }
    println!(
        "cycles {}, left out {}; frames stale {}, out of order {}",
        counts.cycles, counts.skipped_cycles, counts.stale, counts.out_of_order
    );
    Ok(())
}
