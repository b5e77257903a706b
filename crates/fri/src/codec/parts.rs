//! Elements common to both messages.

use super::message::{CartesianPose, Header, Redundancy, TimeStamp};
use crate::error::FriError;
use hwall_protobuf::{Field, Writer};

/// Name of a transformation: the tool's is empty.
const POSE_NAME: &str = "";

/// Writes a nested message with the values in field 1, if there are any. Each value has its own tag, as the controller and the manufacturer's clients
/// write them; packed values are read as well.
pub(super) fn write_nested<const N: usize>(
    writer: &mut Writer,
    field: u32,
    values: Option<&[f64; N]>,
) {
    if let Some(values) = values {
        writer.message(field, |body| body.repeated_doubles(1, values));
    }
}

pub(super) fn write_pose(writer: &mut Writer, field: u32, pose: Option<&CartesianPose>) {
    if let Some(pose) = pose {
        writer.message(field, |body| {
            // Required by the protocol, even when empty.
            body.string(1, POSE_NAME);
            body.repeated_doubles(2, &pose.elements);
        });
    }
}

/// Exactly `N` values of one field of a nested message.
fn doubles<const N: usize>(
    what: &'static str,
    field: &Field,
    number: u32,
) -> Result<[f64; N], FriError> {
    let (mut values, mut found) = ([0.0; N], 0);
    for inner in field.message()? {
        let inner = inner?;
        if inner.number != number {
            continue;
        }
        for value in inner.doubles()? {
            if let Some(place) = values.get_mut(found) {
                *place = value;
            }
            found += 1;
        }
    }
    match found {
        _ if found == N => Ok(values),
        _ => Err(FriError::WrongLength {
            what,
            found,
            expected: N,
        }),
    }
}

/// Fast path for a nested message in the most common form: only a tag and a double for each value.
fn plain<const N: usize>(bytes: &[u8]) -> Option<[f64; N]> {
    /// Field 1, 64-bit.
    const TAG: u8 = 0x09;
    let (pairs, []) = bytes.as_chunks::<9>() else {
        return None;
    };
    let mut values = [0.0; N];
    if pairs.len() != N {
        return None;
    }
    for (value, &[tag, a, b, c, d, e, f, g, h]) in values.iter_mut().zip(pairs) {
        if tag != TAG {
            return None;
        }
        *value = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
    }
    Some(values)
}

/// Values of field 1 of a nested message.
pub(super) fn nested<const N: usize>(
    what: &'static str,
    field: &Field,
) -> Result<Option<[f64; N]>, FriError> {
    match plain(field.to_bytes()?) {
        Some(values) => Ok(Some(values)),
        None => doubles(what, field, 1).map(Some),
    }
}

pub(super) fn write_header(writer: &mut Writer, identifier: u32, header: &Header) {
    writer.message(1, |body| {
        body.uint64(1, u64::from(identifier));
        body.uint64(2, u64::from(header.sequence));
        body.uint64(3, u64::from(header.reflected_sequence));
    });
}

pub(super) fn read_header(field: &Field, identifier: u32) -> Result<Header, FriError> {
    let mut header = Header::default();
    let (mut found, mut sequence, mut reflected) = (None, None, None);
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => found = Some(inner.to_u32()?),
            2 => sequence = Some(inner.to_u32()?),
            3 => reflected = Some(inner.to_u32()?),
            _ => {}
        }
    }
    let found = found.ok_or(FriError::Missing("message identifier"))?;
    if found != identifier {
        let expected = identifier;
        return Err(FriError::OtherMessage { found, expected });
    }
    header.sequence = sequence.ok_or(FriError::Missing("sequence counter"))?;
    header.reflected_sequence = reflected.ok_or(FriError::Missing("reflected counter"))?;
    Ok(header)
}

pub(super) fn read_pose(field: &Field) -> Result<Option<CartesianPose>, FriError> {
    let elements = doubles("pose", field, 2)?;
    Ok(Some(CartesianPose { elements }))
}

pub(super) fn write_redundancy(writer: &mut Writer, field: u32, redundancy: Option<&Redundancy>) {
    if let Some(redundancy) = redundancy {
        writer.message(field, |body| {
            body.int64(1, i64::from(redundancy.strategy));
            body.double(2, redundancy.value_rad);
        });
    }
}

pub(super) fn read_redundancy(field: &Field) -> Result<Option<Redundancy>, FriError> {
    let (mut strategy, mut value) = (None, None);
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => strategy = Some(inner.to_i32()?),
            2 => value = Some(inner.to_f64()?),
            _ => {}
        }
    }
    Ok(Some(Redundancy {
        strategy: strategy.ok_or(FriError::Missing("redundancy strategy"))?,
        value_rad: value.ok_or(FriError::Missing("redundancy value"))?,
    }))
}

pub(super) fn write_time(writer: &mut Writer, field: u32, time: Option<&TimeStamp>) {
    if let Some(time) = time {
        writer.message(field, |body| {
            body.uint64(1, u64::from(time.seconds));
            body.uint64(2, u64::from(time.nanoseconds));
        });
    }
}

pub(super) fn read_time(field: &Field) -> Result<Option<TimeStamp>, FriError> {
    let (mut seconds, mut nanoseconds) = (None, None);
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => seconds = Some(inner.to_u32()?),
            2 => nanoseconds = Some(inner.to_u32()?),
            _ => {}
        }
    }
    let time = TimeStamp {
        seconds: seconds.ok_or(FriError::Missing("seconds"))?,
        nanoseconds: nanoseconds.ok_or(FriError::Missing("nanoseconds"))?,
    };
    match time.nanoseconds {
        0..1_000_000_000 => Ok(Some(time)),
        nanoseconds => Err(FriError::Nanoseconds { nanoseconds }),
    }
}
