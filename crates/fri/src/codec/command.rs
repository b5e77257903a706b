//! The message of the client, field by field.

use super::message::{CommandData, CommandMessage};
use super::parts::{
    nested, read_header, read_pose, read_redundancy, write_header, write_nested, write_pose,
    write_redundancy,
};
use super::version::FriVersion;
use crate::error::FriError;
use hwall_protobuf::{Field, Fields, Writer};

/// Message identifier of the command messages for an LBR.
pub const COMMAND_MESSAGE_ID: u32 = 0x0003_4001;

pub(super) fn write(writer: &mut Writer, message: &CommandMessage, version: FriVersion) {
    write_header(writer, COMMAND_MESSAGE_ID, &message.header);
    let Some(data) = &message.data else {
        return;
    };
    writer.message(2, |body| {
        write_nested(body, 1, data.position_rad.as_ref());
        write_nested(body, 2, data.wrench.as_ref());
        write_nested(body, 3, data.torque_n_m.as_ref());
        if version.has_cartesian_pose() {
            write_pose(body, 6, data.pose.as_ref());
            write_redundancy(body, 7, data.redundancy.as_ref());
        }
    });
}

pub(super) fn read(bytes: &[u8], version: FriVersion) -> Result<CommandMessage, FriError> {
    let (mut header, mut data) = (None, None);
    for field in Fields::new(bytes) {
        let field = field?;
        match field.number {
            1 => header = Some(read_header(&field, COMMAND_MESSAGE_ID)?),
            2 => data = Some(read_data(&field, version)?),
            // The end of the message.
            _ => {}
        }
    }
    Ok(CommandMessage {
        header: header.ok_or(FriError::Missing("header"))?,
        data,
    })
}

fn read_data(field: &Field, version: FriVersion) -> Result<CommandData, FriError> {
    let mut data = CommandData::default();
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => data.position_rad = nested("commanded positions", &inner)?,
            2 => data.wrench = nested("commanded wrench", &inner)?,
            3 => data.torque_n_m = nested("commanded torques", &inner)?,
            6 if version.has_cartesian_pose() => data.pose = read_pose(&inner)?,
            7 if version.has_cartesian_pose() => data.redundancy = read_redundancy(&inner)?,
            // Transformations, inputs and outputs.
            _ => {}
        }
    }
    Ok(data)
}
