//! What connecting and looking costs: datagrams of FRI, a hand's way to the arm, a recording, a replay.

use super::{hand_to_fri, recorded_minute};
use crate::report::{Gap, titled};
use crate::speed::section::{Calls, Section, batches};
use anyhow::Context;
use hwall::haptics::Board;
use hwall_fri::codec::{
    ClientCommandMode, Codec, CommandData, CommandMessage, DATAGRAM_BYTES, Datagram, Header,
    MonitorMessage,
};
use hwall_fri::controller::{Controller, ControllerConfig, InProcess, iiwa7_torque};
use hwall_fri::{FriClient, FriClientConfig, FriVersion};
use hwall_sim::TorqueArm;
use hwall_stage::input::arms::BoardArm;
use hwall_testkit::{Timing, format_ns};
use std::hint::black_box;
use std::time::Duration;

/// Messages, hands, recordings and replays.
///
/// # Errors
/// Whatever the crates refuse; a port or a file that cannot be had.
pub fn connect(seed: u64, n: usize) -> anyhow::Result<Section> {
    let codec = messages(seed)?;
    let frames = (n / 10).clamp(72, 1440);
    let hand = hand_to_fri::measure(seed, frames)?;
    let seconds = (n / 100).clamp(5, 60) as u32;
    let minute = recorded_minute::measure(seed, seconds)?;
    let mut calls = Calls::new("what | median | p99 | largest");
    let mut row = |part: &str, what: &str, timing: &Timing, how: &str| {
        calls.row(what, timing, [&format_ns(timing.max_ns)]);
        calls.quote(part, what, timing, how);
    };
    let (what, how) = (
        "a hand in by WebSocket to its FRI command out",
        "loopback, 72 Hz in, 1 kHz out",
    );
    row("bridge", what, &hand.timing, how);
    let exact = "comes back bit by bit";
    row("record", "a cycle recorded", &minute.cycle, exact);
    let what = "a frame of the hand recorded";
    row("record", what, &minute.frame, exact);
    row("record", "a view recorded", &minute.view, "for viewers");
    let mut sizes = titled("a minute as | size");
    for (what, bytes) in [
        ("recording (MCAP, not compressed)", minute.recording_bytes),
        ("replay.html, 30 frames a second", minute.replay_bytes),
        (".glb of the same frames", minute.glb_bytes),
    ] {
        let mb = 1e-6 * 60.0 / f64::from(seconds) * bytes as f64;
        sizes.row([what.to_owned(), format!("{mb:.2} MB")]);
    }
    let gaps: [Gap<'_>; 9] = [
        ("codec", &codec.table),
        ("hz", &hand_to_fri::HEADSET_HZ),
        ("answered", &hand.answered),
        ("frames", &frames),
        ("expected", &hand.expected),
        ("missed", &hand.missed),
        ("seconds", &seconds),
        ("calls", &calls.table),
        ("sizes", &sizes),
    ];
    let summary = [codec.summary, calls.summary].concat();
    Section::of(include_str!("../text/connect.md"), &gaps, summary)
}

/// Every version's messages, written and read.
fn messages(seed: u64) -> anyhow::Result<Calls> {
    let mut calls = Calls::new("version | what | bytes | median | p99");
    for version in FriVersion::ALL {
        let codec = Codec::new(version);
        let monitor = monitor_message(version, iiwa7_torque(seed)?)?;
        let command = CommandMessage {
            header: Header {
                sequence: 1_000,
                reflected_sequence: monitor.header.sequence,
            },
            data: Some(CommandData {
                position_rad: monitor.data.and_then(|data| data.position_rad),
                torque_n_m: Some([1.5; 7]),
                ..CommandData::default()
            }),
        };
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let (mut sent, mut answer) = (buffer, buffer);
        let sent_bytes = codec.encode_monitor(&monitor, &mut sent)?;
        let answer_bytes = codec.encode_command(&command, &mut answer)?;
        let (sent, answer) = (&sent[..sent_bytes], &answer[..answer_bytes]);
        let mut row = |what: &str, bytes: usize, timing: Timing| {
            calls.row(&format!("{version} | {what} | {bytes}"), &timing, []);
            timing
        };
        let t = batches(|_| codec.encode_monitor(black_box(&monitor), &mut buffer));
        row("state written", sent_bytes, t);
        let t = batches(|_| codec.decode_monitor(black_box(sent)));
        let state_read = row("state read", sent_bytes, t);
        let t = batches(|_| codec.encode_command(black_box(&command), &mut buffer));
        row("command written", answer_bytes, t);
        let t = batches(|_| codec.decode_command(black_box(answer)));
        row("command read", answer_bytes, t);
        let what = format!("a state of FRI {version} read");
        calls.quote("fri", &what, &state_read, "exact; 0 allocations");
    }
    Ok(calls)
}

/// What a controller sends while torques are commanded.
fn monitor_message(version: FriVersion, plant: TorqueArm) -> anyhow::Result<MonitorMessage> {
    let arm = BoardArm::named("iiwa7", &Board::default())?;
    let config = ControllerConfig {
        version,
        mode: ClientCommandMode::Torque,
        ..ControllerConfig::default()
    };
    let way = InProcess::new(Controller::new(plant, config)?);
    let config = FriClientConfig {
        version,
        ..FriClientConfig::default()
    };
    let mut client = FriClient::over(arm.kinematics(), config, way)?;
    client.wait_for_commanding(Duration::from_secs(10))?;
    client
        .message()
        .copied()
        .context("no message of the controller")
}

#[cfg(test)]
mod tests {
    use super::connect;

    #[test]
    fn every_row_is_measured() {
        let section = connect(1, 100).expect("loopback and a folder for temporary files");
        assert_eq!(section.summary.len(), 7);
        assert!(section.text.contains("MB"));
    }
}
