//! The message of the controller, field by field.

use super::message::{
    ConnectionInfo, InterpolatorData, JOINTS, MonitorData, MonitorMessage, RobotInfo,
};
use super::parts::{
    nested, read_header, read_pose, read_redundancy, read_time, write_header, write_nested,
    write_pose, write_redundancy, write_time,
};
use super::states::{
    ClientCommandMode, ConnectionQuality, ControlMode, DriveState, OperationMode, OverlayType,
    SafetyState, SessionState,
};
use super::version::FriVersion;
use crate::error::FriError;
use hwall_protobuf::{Field, Fields, Writer};

/// Message identifier of the monitor messages of an LBR.
pub const MONITOR_MESSAGE_ID: u32 = 0x0024_5142;

pub(super) fn write(writer: &mut Writer, message: &MonitorMessage, version: FriVersion) {
    write_header(writer, MONITOR_MESSAGE_ID, &message.header);
    if let Some(robot) = &message.robot {
        writer.message(2, |body| write_robot(body, robot));
    }
    if let Some(data) = &message.data {
        writer.message(3, |body| write_data(body, data, version));
    }
    writer.message(4, |body| write_connection(body, &message.connection));
    if let Some(data) = &message.interpolator {
        writer.message(5, |body| write_interpolator(body, data, version));
    }
}

fn write_robot(writer: &mut Writer, robot: &RobotInfo) {
    let mut number = |field, value: Option<u64>| {
        if let Some(value) = value {
            writer.uint64(field, value);
        }
    };
    number(1, robot.joint_count.map(u64::from));
    number(2, robot.safety.map(SafetyState::number));
    for drive in robot.drives.iter().flatten() {
        number(5, Some(drive.number()));
    }
    number(6, robot.operation.map(OperationMode::number));
    number(7, robot.control.map(ControlMode::number));
}

/// A number that no version defines for an enumeration.
const UNKNOWN: u64 = 99;

pub(super) fn write_unknown_robot(writer: &mut Writer) {
    writer.message(2, |body| {
        body.uint64(1, JOINTS as u64);
        body.uint64(2, UNKNOWN);
        for _ in 0..JOINTS {
            body.uint64(5, UNKNOWN);
        }
        body.uint64(6, UNKNOWN);
        body.uint64(7, UNKNOWN);
    });
}

fn write_data(writer: &mut Writer, data: &MonitorData, version: FriVersion) {
    write_nested(writer, 1, data.position_rad.as_ref());
    write_nested(writer, 2, data.torque_n_m.as_ref());
    if version.has_commanded_position() {
        write_nested(writer, 3, data.commanded_position_rad.as_ref());
    }
    write_nested(writer, 4, data.commanded_torque_n_m.as_ref());
    write_nested(writer, 5, data.external_torque_n_m.as_ref());
    if version.has_external_force() {
        write_nested(writer, 6, data.external_force.as_ref());
    }
    if version.has_cartesian_pose() {
        write_pose(writer, 9, data.pose.as_ref());
        write_redundancy(writer, 10, data.redundancy.as_ref());
    }
    write_time(writer, 15, data.time.as_ref());
}

fn write_connection(writer: &mut Writer, connection: &ConnectionInfo) {
    writer.uint64(1, connection.state.number());
    writer.uint64(2, connection.quality.number());
    if let Some(period) = connection.send_period_ms {
        writer.uint64(3, u64::from(period));
    }
    if let Some(multiplier) = connection.receive_multiplier {
        writer.uint64(4, u64::from(multiplier));
    }
}

fn write_interpolator(writer: &mut Writer, data: &InterpolatorData, version: FriVersion) {
    write_nested(writer, 1, data.position_rad.as_ref());
    if version.has_cartesian_pose() {
        write_pose(writer, 2, data.pose.as_ref());
        write_redundancy(writer, 3, data.redundancy.as_ref());
    }
    if let Some(mode) = data.command_mode {
        writer.uint64(10, mode.number());
    }
    if let Some(overlay) = data.overlay {
        writer.uint64(11, overlay.number());
    }
    if let Some(tracking) = data.tracking {
        writer.double(12, tracking);
    }
}

pub(super) fn read(bytes: &[u8], version: FriVersion) -> Result<MonitorMessage, FriError> {
    let (mut header, mut connection) = (None, None);
    let (mut robot, mut data, mut interpolator) = (None, None, None);
    for field in Fields::new(bytes) {
        let field = field?;
        match field.number {
            1 => header = Some(read_header(&field, MONITOR_MESSAGE_ID)?),
            2 => robot = Some(read_robot(&field)?),
            3 => data = Some(read_data(&field, version)?),
            4 => connection = Some(read_connection(&field)?),
            5 => interpolator = Some(read_interpolator(&field, version)?),
            // Requested transformations and the end of the message.
            _ => {}
        }
    }
    Ok(MonitorMessage {
        header: header.ok_or(FriError::Missing("header"))?,
        robot,
        data,
        connection: connection.ok_or(FriError::Missing("connection info"))?,
        interpolator,
    })
}

/// These enumerations are informative, and other controller releases may have more values. An unknown value is omitted.
fn read_robot(field: &Field) -> Result<RobotInfo, FriError> {
    let mut robot = RobotInfo::default();
    let mut drives = [None; JOINTS];
    let mut count = 0;
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => robot.joint_count = Some(inner.to_u32()?),
            2 => robot.safety = SafetyState::from_number(inner.to_i32()?).ok(),
            5 => {
                for number in inner.varints()? {
                    let number = i32::try_from(number?).unwrap_or(i32::MAX);
                    if let Some(place) = drives.get_mut(count) {
                        *place = DriveState::from_number(number).ok();
                    }
                    count += 1;
                }
            }
            6 => robot.operation = OperationMode::from_number(inner.to_i32()?).ok(),
            7 => robot.control = ControlMode::from_number(inner.to_i32()?).ok(),
            _ => {}
        }
    }
    robot.drives = match count {
        0 => None,
        // One unknown state makes the whole array unknown.
        JOINTS => drives
            .iter()
            .all(Option::is_some)
            .then(|| drives.map(|drive| drive.unwrap_or(DriveState::Off))),
        found => {
            return Err(FriError::WrongLength {
                what: "drive states",
                found,
                expected: JOINTS,
            });
        }
    };
    Ok(robot)
}

fn read_data(field: &Field, version: FriVersion) -> Result<MonitorData, FriError> {
    let mut data = MonitorData::default();
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => data.position_rad = nested("measured positions", &inner)?,
            2 => data.torque_n_m = nested("measured torques", &inner)?,
            3 if version.has_commanded_position() => {
                data.commanded_position_rad = nested("commanded positions", &inner)?;
            }
            4 => data.commanded_torque_n_m = nested("commanded torques", &inner)?,
            5 => data.external_torque_n_m = nested("external torques", &inner)?,
            6 if version.has_external_force() => {
                data.external_force = nested("external force", &inner)?;
            }
            9 if version.has_cartesian_pose() => data.pose = read_pose(&inner)?,
            10 if version.has_cartesian_pose() => data.redundancy = read_redundancy(&inner)?,
            15 => data.time = read_time(&inner)?,
            // Inputs and outputs.
            _ => {}
        }
    }
    Ok(data)
}

fn read_connection(field: &Field) -> Result<ConnectionInfo, FriError> {
    let (mut state, mut quality) = (None, None);
    let (mut send_period_ms, mut receive_multiplier) = (None, None);
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => state = Some(SessionState::from_number(inner.to_i32()?)?),
            2 => quality = Some(ConnectionQuality::from_number(inner.to_i32()?)?),
            3 => send_period_ms = Some(inner.to_u32()?),
            4 => receive_multiplier = Some(inner.to_u32()?),
            _ => {}
        }
    }
    Ok(ConnectionInfo {
        state: state.ok_or(FriError::Missing("session state"))?,
        quality: quality.ok_or(FriError::Missing("connection quality"))?,
        send_period_ms,
        receive_multiplier,
    })
}

fn read_interpolator(field: &Field, version: FriVersion) -> Result<InterpolatorData, FriError> {
    let mut data = InterpolatorData::default();
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => data.position_rad = nested("positions of the interpolator", &inner)?,
            2 if version.has_cartesian_pose() => data.pose = read_pose(&inner)?,
            3 if version.has_cartesian_pose() => data.redundancy = read_redundancy(&inner)?,
            10 => data.command_mode = ClientCommandMode::from_number(inner.to_i32()?).ok(),
            11 => data.overlay = OverlayType::from_number(inner.to_i32()?).ok(),
            12 => data.tracking = Some(inner.to_f64()?),
            _ => {}
        }
    }
    Ok(data)
}
