//! What a session was given and what it answered: written, and read back bit by bit.

use crate::error::RecordError;
use crate::recording::{Input, Request};
use crate::setup::{ArmSource, Run, Setup};
use glam::{DMat3, DVec3};
use hwall::Cycle;
use hwall::WorldPose;
use hwall::geometry::Pose;
use hwall::hand::{BodyPoint, HandFrame, HandPoint};
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::kinematics::{JointPositions, JointTorques, JointVelocities};
use hwall_protobuf::{Field, Fields, ProtobufError, Writer};

/// A message of a session channel, and where it lies in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body<'a> {
    pub(crate) channel: &'static str,
    pub(crate) offset: u64,
    pub(crate) bytes: &'a [u8],
}

pub(crate) const SETUP: &str = "/session/setup";
pub(crate) const RUN: &str = "/session/run";
pub(crate) const FRAME: &str = "/session/frame";
pub(crate) const WORLD: &str = "/session/world";
pub(crate) const REQUEST: &str = "/session/request";
pub(crate) const CYCLE: &str = "/session/cycle";
pub(crate) const END: &str = "/session/end";

pub(crate) fn write_setup(writer: &mut Writer<'_>, setup: &Setup) {
    writer.string(1, &setup.program);
    writer.string(2, &setup.scene_obj);
    if let Some(sidecar) = &setup.scene_sidecar {
        writer.string(3, sidecar);
    }
    writer.string(4, setup.arm.name());
    if let ArmSource::Urdf { text, .. } = &setup.arm {
        writer.string(5, text);
    }
    writer.double(6, setup.board.half_width_m);
    writer.double(7, setup.board.half_height_m);
    writer.double(8, setup.board.thickness_m);
    write_options(writer, 9, &setup.options);
}

fn write_options(writer: &mut Writer<'_>, field: u32, options: &[(String, String)]) {
    for (key, value) in options {
        writer.message(field, |option| {
            option.string(1, key);
            option.string(2, value);
        });
    }
}

pub(crate) fn write_run(writer: &mut Writer<'_>, sequence: u64, run: &Run) {
    writer.uint64(1, sequence);
    writer.uint64(2, u64::from(run.number));
    write_options(writer, 3, &run.options);
}

fn write_vector(writer: &mut Writer<'_>, field: u32, v: DVec3) {
    writer.message(field, |vector| {
        vector.double(1, v.x);
        vector.double(2, v.y);
        vector.double(3, v.z);
    });
}

/// Where the points of arm and controller begin among the fields of a frame; older recordings end before them.
const FIRST_BODY_FIELD: u32 = 11;
/// Whether a frame shows another person, where it does.
const ANOTHER_FIELD: u32 = 17;
/// The other hand, where it is tracked.
const OTHER_HAND_FIELD: u32 = 18;

pub(crate) fn write_frame(writer: &mut Writer<'_>, sequence: u64, frame: &HandFrame) {
    writer.uint64(1, sequence);
    writer.double(2, frame.t_s);
    // As they came: what the tracker's driver sent, with its NaN.
    let points = [frame.palm_m]
        .into_iter()
        .chain(frame.tips_m)
        .chain([frame.head_m, frame.gaze])
        .chain(frame.body_m);
    for (field, point) in (3..).zip(points) {
        if let Some(point) = point {
            write_vector(writer, field, point);
        }
    }
    if let Some(other_hand_m) = frame.other_hand_m {
        write_vector(writer, OTHER_HAND_FIELD, other_hand_m);
    }
    if frame.is_of_another {
        writer.uint64(ANOTHER_FIELD, 1);
    }
}

pub(crate) fn write_world(writer: &mut Writer<'_>, sequence: u64, world: &WorldPose) {
    writer.uint64(1, sequence);
    writer.double(2, world.t_s);
    write_vector(writer, 3, world.base_from_world.position_m());
    let columns = world.base_from_world.rotation().to_cols_array();
    writer.packed_doubles(4, &columns);
}

pub(crate) fn write_request(writer: &mut Writer<'_>, sequence: u64, request: Request) {
    writer.uint64(1, sequence);
    let (kind, value_s) = match request {
        Request::Stop => (0, None),
        Request::Reset => (1, None),
        Request::Refused => (3, None),
        Request::Perceived => (5, None),
        Request::Planned { step, surfaces } => {
            writer.uint64(4, step);
            writer.uint64(5, surfaces);
            (4, None)
        }
        Request::ClockOffset {
            arm_minus_tracker_s,
        } => (2, Some(arm_minus_tracker_s)),
    };
    writer.uint64(2, kind);
    if let Some(value_s) = value_s {
        writer.double(3, value_s);
    }
}

/// A command that this version does not know is written as a hold without values; no such command exists.
pub(crate) fn write_cycle(writer: &mut Writer<'_>, sequence: u64, cycle: &Cycle) {
    writer.uint64(1, sequence);
    writer.double(2, cycle.t_s);
    writer.double(3, cycle.state.t_s);
    writer.packed_doubles(4, &cycle.state.q.0);
    writer.packed_doubles(5, &cycle.state.qd.0);
    if let Some(torque) = &cycle.state.external_torque {
        writer.packed_doubles(6, &torque.0);
    }
    match &cycle.command {
        ArmCommand::Position(q) => {
            writer.uint64(7, 1);
            writer.packed_doubles(8, &q.0);
        }
        ArmCommand::Torque(torque) => {
            writer.uint64(7, 2);
            writer.packed_doubles(8, &torque.0);
        }
        _ => writer.uint64(7, 0),
    }
}

pub(crate) fn write_end(writer: &mut Writer<'_>, sequence: u64, dropped: u64) {
    writer.uint64(1, sequence);
    writer.uint64(2, dropped);
}

/// Values of one repeated field, at most `N`.
struct Values<const N: usize> {
    values: [f64; N],
    count: usize,
}

impl<const N: usize> Values<N> {
    const fn new() -> Self {
        Self {
            values: [0.0; N],
            count: 0,
        }
    }

    /// Values beyond the last place are counted, and refused later.
    fn take(&mut self, field: &Field<'_>) -> Result<(), ProtobufError> {
        for value in field.doubles()? {
            if let Some(place) = self.values.get_mut(self.count) {
                *place = value;
            }
            self.count += 1;
        }
        Ok(())
    }
}

impl<'a> Body<'a> {
    /// Calls `take` for every field.
    fn fields(
        &self,
        mut take: impl FnMut(&Field<'a>) -> Result<(), ProtobufError>,
    ) -> Result<(), RecordError> {
        let mut read = || {
            for field in Fields::new(self.bytes) {
                take(&field?)?;
            }
            Ok(())
        };
        read().map_err(|problem| RecordError::Message {
            channel: self.channel,
            offset: self.offset,
            problem,
        })
    }

    fn wrong(&self, field: &'static str, problem: &'static str) -> RecordError {
        RecordError::Value {
            channel: self.channel,
            offset: self.offset,
            field,
            problem,
        }
    }

    fn all<const N: usize>(
        &self,
        field: &'static str,
        values: &Values<N>,
    ) -> Result<[f64; N], RecordError> {
        if values.count == N {
            Ok(values.values)
        } else {
            Err(self.wrong(field, "another number of values than it has"))
        }
    }

    /// What the session was made of.
    pub(crate) fn setup(&self) -> Result<Setup, RecordError> {
        let mut setup = Setup {
            program: String::new(),
            scene_obj: String::new(),
            scene_sidecar: None,
            arm: ArmSource::Named(String::new()),
            board: Board::default(),
            options: Vec::new(),
        };
        let (mut arm, mut urdf) = (String::new(), None);
        self.fields(|field| {
            match field.number {
                1 => setup.program = field.to_str()?.to_owned(),
                2 => setup.scene_obj = field.to_str()?.to_owned(),
                3 => setup.scene_sidecar = Some(field.to_str()?.to_owned()),
                4 => arm = field.to_str()?.to_owned(),
                5 => urdf = Some(field.to_str()?.to_owned()),
                6 => setup.board.half_width_m = field.to_f64()?,
                7 => setup.board.half_height_m = field.to_f64()?,
                8 => setup.board.thickness_m = field.to_f64()?,
                9 => setup.options.push(option_of(field)?),
                _ => {}
            }
            Ok(())
        })?;
        let sound = setup.board.validate().is_ok();
        if !sound {
            return Err(self.wrong("board", "no size that a board can have"));
        }
        setup.arm = match urdf {
            Some(text) => ArmSource::Urdf { name: arm, text },
            None => ArmSource::Named(arm),
        };
        Ok(setup)
    }

    /// The number of the message among all of the session, and what it says.
    pub(crate) fn input(&self) -> Result<(u64, Input), RecordError> {
        match self.channel {
            RUN => self.run(),
            FRAME => self.frame(),
            WORLD => self.world(),
            REQUEST => self.request(),
            CYCLE => self.cycle(),
            END => self.end(),
            _ => Err(self.wrong("channel", "no channel of a session")),
        }
    }

    fn run(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut run) = (0, Run::default());
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => run.number = field.to_u32()?,
                3 => run.options.push(option_of(field)?),
                _ => {}
            }
            Ok(())
        })?;
        Ok((sequence, Input::Run(run)))
    }

    fn frame(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut frame) = (0, HandFrame::default());
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => frame.t_s = field.to_f64()?,
                n @ 3..=8 => {
                    let point = HandPoint::ALL.get(n as usize - 3);
                    if let Some(point) = point {
                        frame.set_point(*point, Some(vector_of(field)?));
                    }
                }
                9 => frame.head_m = Some(vector_of(field)?),
                10 => frame.gaze = Some(vector_of(field)?),
                OTHER_HAND_FIELD => frame.other_hand_m = Some(vector_of(field)?),
                ANOTHER_FIELD => frame.is_of_another = field.to_u64()? != 0,
                n => {
                    let point = n.checked_sub(FIRST_BODY_FIELD).map(|k| k as usize);
                    if let Some(point) = point.and_then(|k| BodyPoint::ALL.get(k)) {
                        frame.set_body(*point, Some(vector_of(field)?));
                    }
                }
            }
            Ok(())
        })?;
        Ok((sequence, Input::Frame(frame)))
    }

    fn world(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut t_s, mut position_m) = (0, 0.0, DVec3::ZERO);
        let mut columns = Values::<9>::new();
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => t_s = field.to_f64()?,
                3 => position_m = vector_of(field)?,
                4 => columns.take(field)?,
                _ => {}
            }
            Ok(())
        })?;
        let rotation = DMat3::from_cols_array(&self.all("rotation_columns", &columns)?);
        if Pose::new(rotation, position_m).is_err() {
            return Err(self.wrong("rotation_columns", "no rigid motion"));
        }
        // `Pose::new` moves a matrix to the nearest rotation: here its bits count.
        let base_from_world = Pose::from_parts_unchecked(rotation, position_m);
        let world = WorldPose {
            t_s,
            base_from_world,
        };
        Ok((sequence, Input::World(world)))
    }

    fn request(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut kind, mut value_s) = (0, 0, 0.0);
        let (mut step, mut surfaces) = (0, 0);
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => kind = field.to_u64()?,
                3 => value_s = field.to_f64()?,
                4 => step = field.to_u64()?,
                5 => surfaces = field.to_u64()?,
                _ => {}
            }
            Ok(())
        })?;
        let request = match kind {
            0 => Request::Stop,
            1 => Request::Reset,
            3 => Request::Refused,
            4 => Request::Planned { step, surfaces },
            5 => Request::Perceived,
            2 => Request::ClockOffset {
                arm_minus_tracker_s: value_s,
            },
            _ => return Err(self.wrong("kind", "no request that is known")),
        };
        Ok((sequence, Input::Request(request)))
    }

    fn cycle(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut t_s, mut state_t_s, mut kind) = (0, 0.0, 0.0, 0);
        let (mut q, mut qd) = (Values::<7>::new(), Values::<7>::new());
        let (mut torque, mut values) = (Values::<7>::new(), Values::<7>::new());
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => t_s = field.to_f64()?,
                3 => state_t_s = field.to_f64()?,
                4 => q.take(field)?,
                5 => qd.take(field)?,
                6 => torque.take(field)?,
                7 => kind = field.to_u64()?,
                8 => values.take(field)?,
                _ => {}
            }
            Ok(())
        })?;
        let state = ArmState {
            t_s: state_t_s,
            q: JointPositions(self.all("q_rad", &q)?),
            qd: JointVelocities(self.all("qd_rad_per_s", &qd)?),
            external_torque: match torque.count {
                0 => None,
                _ => Some(JointTorques(self.all("external_torque_n_m", &torque)?)),
            },
        };
        let command = match kind {
            0 => ArmCommand::Hold,
            1 => ArmCommand::Position(JointPositions(self.all("command_values", &values)?)),
            2 => ArmCommand::Torque(JointTorques(self.all("command_values", &values)?)),
            _ => return Err(self.wrong("command", "no command that is known")),
        };
        let cycle = Cycle {
            t_s,
            state,
            command,
        };
        Ok((sequence, Input::Cycle(cycle)))
    }

    fn end(&self) -> Result<(u64, Input), RecordError> {
        let (mut sequence, mut dropped) = (0, 0);
        self.fields(|field| {
            match field.number {
                1 => sequence = field.to_u64()?,
                2 => dropped = field.to_u64()?,
                _ => {}
            }
            Ok(())
        })?;
        Ok((sequence, Input::End { dropped }))
    }
}

fn option_of(field: &Field<'_>) -> Result<(String, String), ProtobufError> {
    let mut option = (String::new(), String::new());
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => option.0 = inner.to_str()?.to_owned(),
            2 => option.1 = inner.to_str()?.to_owned(),
            _ => {}
        }
    }
    Ok(option)
}

fn vector_of(field: &Field<'_>) -> Result<DVec3, ProtobufError> {
    let mut v = DVec3::ZERO;
    for inner in field.message()? {
        let inner = inner?;
        match inner.number {
            1 => v.x = inner.to_f64()?,
            2 => v.y = inner.to_f64()?,
            3 => v.z = inner.to_f64()?,
            _ => {}
        }
    }
    Ok(v)
}
