//! One line of the log: checksum of all lines up to this one, a space, the event as JSON.

use super::event::Event;
use crc::{CRC_32_ISCSI, Crc};

/// CRC-32C, as used for disk and network blocks: detects every error of up to five bits in a line.
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// The checksum before the first line.
pub(super) const START: u32 = 0x4857_0001;

/// Hexadecimal digits of a checksum, and a space.
const HEAD: usize = 9;

fn checksum(before: u32, json: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&before.to_le_bytes());
    digest.update(json);
    digest.finalize()
}

/// Start of the JSON of the first line.
const FIRST: &[u8] = b"{\"event\":\"opened\",";

/// Can these bytes, without a line feed, be a truncated first line?
pub(super) fn is_cut_first_line(bytes: &[u8]) -> bool {
    let (digits, rest) = bytes.split_at(bytes.len().min(HEAD - 1));
    let lower = digits
        .iter()
        .all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    let mut begin = b" ".iter().chain(FIRST);
    lower
        && rest
            .iter()
            .all(|b| begin.next().is_none_or(|wanted| wanted == b))
        && !rest.contains(&b'\n')
}

/// Does any line look like a log line, with any checksum?
pub(super) fn holds_log_lines(bytes: &[u8]) -> bool {
    bytes.split(|b| *b == b'\n').any(|line| {
        let json = line.get(HEAD..).unwrap_or_default();
        json.starts_with(b"{\"event\":\"")
            && is_cut_first_line(line.get(..HEAD).unwrap_or_default())
    })
}

/// The line of an event with its line feed, and its checksum.
pub(super) fn encode(before: u32, event: &Event) -> Option<(String, u32)> {
    let json = serde_json::to_string(event).ok()?;
    let sum = checksum(before, json.as_bytes());
    Some((format!("{sum:08x} {json}\n"), sum))
}

/// The event of a line without its line feed, and its checksum; `None` for a changed line.
pub(super) fn decode(before: u32, line: &[u8]) -> Option<(Event, u32)> {
    let (head, json) = (line.get(..HEAD)?, line.get(HEAD..)?);
    let digits = std::str::from_utf8(head.strip_suffix(b" ")?).ok()?;
    let lower = digits
        .bytes()
        .all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    let sum = u32::from_str_radix(digits, 16).ok().filter(|_| lower)?;
    if sum != checksum(before, json) {
        return None;
    }
    Some((serde_json::from_slice(json).ok()?, sum))
}
