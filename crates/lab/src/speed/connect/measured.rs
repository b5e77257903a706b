//! What connecting and looking costs: datagrams of FRI, a hand's way to the arm, a recording, a replay.

use super::{hand_to_fri, recorded_minute};
use crate::speed::page::section::{Section, SummaryRow, batches};
use hwall::haptics::Board;
use hwall_fri::codec::ClientCommandMode;
use hwall_fri::codec::{
    Codec, CommandData, CommandMessage, DATAGRAM_BYTES, Datagram, Header, MonitorMessage,
};
use hwall_fri::controller::{Controller, ControllerConfig, InProcess, iiwa7_torque};
use hwall_fri::{FriClient, FriClientConfig, FriVersion};
use hwall_sim::TorqueArm;
use hwall_stage::input::arms::BoardArm;
use hwall_testkit::{MarkdownTable, Timing, format_ns};
use std::hint::black_box;
use std::time::Duration;

/// Messages, hands, recordings and replays.
///
/// # Errors
/// Whatever the crates refuse; a port or a file that cannot be had.
pub fn connect(seed: u64, n: usize) -> anyhow::Result<Section> {
    let (codec, mut summary) = messages(seed)?;
    let frames = (n / 10).clamp(72, 1440);
    let hand = hand_to_fri::measure(seed, frames)?;
    let seconds = (n / 100).clamp(5, 60) as u32;
    let minute = recorded_minute::measure(seed, seconds)?;
    let mut calls = MarkdownTable::new(["what", "median", "p99", "largest"]);
    let mut row = |krate: &str, what: &str, timing: &Timing, how: &str| {
        calls.row([
            what.to_owned(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            format_ns(timing.max_ns),
        ]);
        summary.push(SummaryRow::new(krate, what, timing, how));
    };
    row(
        "bridge",
        "a hand in by WebSocket to its FRI command out",
        &hand.timing,
        "loopback, 72 Hz in, 1 kHz out",
    );
    let exact = "comes back bit by bit";
    row("record", "a cycle recorded", &minute.cycle, exact);
    row(
        "record",
        "a frame of the hand recorded",
        &minute.frame,
        exact,
    );
    row("record", "a view recorded", &minute.view, "for viewers");
    let per_minute = 1e-6 * 60.0 / f64::from(seconds);
    let mb = |bytes: u64| format!("{:.2} MB", per_minute * bytes as f64);
    let mut sizes = MarkdownTable::new(["a minute as", "size"]);
    for (what, bytes) in [
        ("recording (MCAP, not compressed)", minute.recording_bytes),
        (
            "replay.html, 30 frames a second",
            minute.replay_bytes as u64,
        ),
        (".glb of the same frames", minute.glb_bytes as u64),
    ] {
        sizes.row([what.to_owned(), mb(bytes)]);
    }
    let text = format!(
        "### Connect and look\n\nMessages of FRI in mode torque, as the simulated controller sends them and as the client \
         answers; nothing is allocated (tests/it/codec.rs of `hwall-fri`).\n\n{codec}\nA hand comes in by WebSocket {:.0} times a \
         second, over loopback, and a session leads the simulated controller at 1 kHz; timed from before the frame is written \
         until the command of the cycle that took it has been sent. On average half a millisecond of it is the wait for that cycle. {} of \
         {frames} frames were answered; of {} messages of the controller {} were not in time. The recorder's calls are those \
         of a session of {seconds} s in the built-in room, as fast as it goes.\n\n{calls}\n{sizes}",
        hand_to_fri::HEADSET_HZ,
        hand.answered,
        hand.expected,
        hand.missed,
    );
    Ok(Section::of(text, summary))
}

/// Every version's messages, written and read.
fn messages(seed: u64) -> anyhow::Result<(MarkdownTable, Vec<SummaryRow>)> {
    let mut table = MarkdownTable::new(["version", "what", "bytes", "median", "p99"]);
    let mut summary = Vec::new();
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
        let state_written = batches(|_| codec.encode_monitor(black_box(&monitor), &mut buffer));
        let state_read = batches(|_| codec.decode_monitor(black_box(sent)));
        let command_written = batches(|_| codec.encode_command(black_box(&command), &mut buffer));
        let command_read = batches(|_| codec.decode_command(black_box(answer)));
        for (what, bytes, timing) in [
            ("state written", sent_bytes, &state_written),
            ("state read", sent_bytes, &state_read),
            ("command written", answer_bytes, &command_written),
            ("command read", answer_bytes, &command_read),
        ] {
            table.row([
                version.to_string(),
                what.to_owned(),
                bytes.to_string(),
                format_ns(timing.median_ns),
                format_ns(timing.p99_ns),
            ]);
        }
        let what = format!("a state of FRI {version} read");
        summary.push(SummaryRow::new(
            "fri",
            &what,
            &state_read,
            "exact; 0 allocations",
        ));
    }
    Ok((table, summary))
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
    let message = client.message().copied();
    message.ok_or_else(|| anyhow::anyhow!("no message of the controller"))
}

#[cfg(test)]
mod tests {
    use super::connect;

    #[test]
    fn every_row_is_measured() {
        let section = connect(1, 100).expect("loopback and a folder for temporary files");
        println!("{}", section.text);
        assert_eq!(section.summary.len(), 7);
        assert!(section.text.contains("MB"));
    }
}
