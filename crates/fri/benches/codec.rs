//! Cost of a message, and its round trip: `cargo bench -p hwall-fri --bench codec`.

#[path = "../tests/it/common/mod.rs"]
mod common;

use common::{full_command, full_monitor};
use hwall_fri::FriVersion;
use hwall_fri::codec::{Codec, DATAGRAM_BYTES, Datagram};
use hwall_testkit::{Machine, MarkdownTable, time_batches};
use std::hint::black_box;

const BATCHES: usize = 2000;
const CALLS: usize = 100;

fn main() {
    println!("{}", Machine::detect(1));
    let mut table = MarkdownTable::new(["version", "what", "bytes", "median ns", "p99 ns"]);
    for version in FriVersion::ALL {
        let codec = Codec::new(version);
        let (monitor, command) = (full_monitor(), full_command());
        let mut sent: Datagram = [0; DATAGRAM_BYTES];
        let mut answer: Datagram = [0; DATAGRAM_BYTES];
        let sent_bytes = codec.encode_monitor(&monitor, &mut sent).expect("it fits");
        let answer_bytes = codec
            .encode_command(&command, &mut answer)
            .expect("it fits");
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let mut row = |what: &str, bytes: usize, call: &mut dyn FnMut()| {
            let timing = time_batches(BATCHES, CALLS, |_| call());
            table.row([
                version.to_string(),
                what.to_owned(),
                bytes.to_string(),
                format!("{:.0}", timing.median_ns),
                format!("{:.0}", timing.p99_ns),
            ]);
        };
        row("monitor written", sent_bytes, &mut || {
            black_box(codec.encode_monitor(black_box(&monitor), &mut buffer)).expect("it fits");
        });
        row("monitor read", sent_bytes, &mut || {
            black_box(codec.decode_monitor(black_box(&sent[..sent_bytes]))).expect("a message");
        });
        row("command written", answer_bytes, &mut || {
            black_box(codec.encode_command(black_box(&command), &mut buffer)).expect("it fits");
        });
        row("command read", answer_bytes, &mut || {
            black_box(codec.decode_command(black_box(&answer[..answer_bytes]))).expect("a message");
        });
    }
    println!("{table}");
}
