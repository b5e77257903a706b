//! Inputs and outputs of a session: written, and read back bit by bit.

use super::look::vector;
use crate::error::RecordError;
use crate::input::{Input, Request};
use crate::setup::{ArmSource, Run, Setup};
use glam::{DMat3, DVec3};
use hwall::Cycle;
use hwall::WorldPose;
use hwall::geometry::Pose;
use hwall::hand::{BodyPoint, Bystanders, HandFrame, HandPoint, MOST_BYSTANDERS};
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::kinematics::{JointPositions, JointTorques, JointVelocities};
use hwall_protobuf::{Field, Fields, ProtobufError, Writer};

/// A message of a session channel, and its position in the file.
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

/// First field of arm and controller points in a frame; older recordings do not have them.
const FIRST_BODY_FIELD: u32 = 11;
/// Field for a frame that shows another person.
const ANOTHER_FIELD: u32 = 17;
/// Field of the other hand, if it is tracked.
const OTHER_HAND_FIELD: u32 = 18;
/// Field of one more than the number of bystanders, if the frame says who stands by; their heads follow.
const BYSTANDERS_FIELD: u32 = 19;

/// Writes a message of a session, with its number among all messages of the session. A command unknown to this version would be written
/// as a hold without values; no such command exists.
pub(crate) fn write(writer: &mut Writer<'_>, sequence: u64, input: &Input) {
    writer.uint64(1, sequence);
    match input {
        Input::Run(run) => {
            writer.uint64(2, u64::from(run.number));
            write_options(writer, 3, &run.options);
        }
        Input::Frame(frame) => {
            writer.double(2, frame.t_s);
            // Unfiltered: the data of the tracker's driver, including NaN.
            let points = [frame.palm_m]
                .into_iter()
                .chain(frame.tips_m)
                .chain([frame.head_m, frame.gaze])
                .chain(frame.body_m);
            for (field, point) in (3..).zip(points) {
                if let Some(point) = point {
                    vector(writer, field, point);
                }
            }
            if let Some(other_hand_m) = frame.other_hand_m {
                vector(writer, OTHER_HAND_FIELD, other_hand_m);
            }
            if let Some(bystanders) = &frame.bystanders {
                let heads_m = bystanders.heads_m();
                writer.uint64(BYSTANDERS_FIELD, heads_m.len() as u64 + 1);
                for (field, head_m) in (BYSTANDERS_FIELD + 1..).zip(heads_m) {
                    if let Some(head_m) = head_m {
                        vector(writer, field, head_m);
                    }
                }
            }
            if frame.is_of_another {
                writer.uint64(ANOTHER_FIELD, 1);
            }
        }
        Input::World(world) => {
            writer.double(2, world.t_s);
            vector(writer, 3, world.base_from_world.position_m());
            let columns = world.base_from_world.rotation().to_cols_array();
            writer.packed_doubles(4, &columns);
        }
        Input::Request(request) => {
            let kind = match request {
                Request::Stop => 0,
                Request::Reset => 1,
                Request::ClockOffset { .. } => 2,
                Request::Refused => 3,
                Request::Planned { .. } => 4,
                Request::Perceived => 5,
            };
            writer.uint64(2, kind);
            match *request {
                Request::ClockOffset {
                    arm_minus_tracker_s,
                } => writer.double(3, arm_minus_tracker_s),
                Request::Planned { step, surfaces } => {
                    writer.uint64(4, step);
                    writer.uint64(5, surfaces);
                }
                _ => {}
            }
        }
        Input::Cycle(Cycle {
            t_s,
            state,
            command,
        }) => {
            writer.double(2, *t_s);
            writer.double(3, state.t_s);
            writer.packed_doubles(4, &state.q.0);
            writer.packed_doubles(5, &state.qd.0);
            if let Some(torque) = &state.external_torque {
                writer.packed_doubles(6, &torque.0);
            }
            let (kind, values) = match command {
                ArmCommand::Position(q) => (1, Some(&q.0)),
                ArmCommand::Torque(torque) => (2, Some(&torque.0)),
                _ => (0, None),
            };
            writer.uint64(7, kind);
            if let Some(values) = values {
                writer.packed_doubles(8, values);
            }
        }
        Input::End { dropped } => writer.uint64(2, *dropped),
    }
}

impl<'a> Body<'a> {
    /// Calls `take` for every field with this number.
    fn each(
        &self,
        number: u32,
        mut take: impl FnMut(&Field<'a>) -> Result<(), ProtobufError>,
    ) -> Result<(), RecordError> {
        let mut read = || {
            for field in Fields::new(self.bytes) {
                let field = field?;
                if field.number == number {
                    take(&field)?;
                }
            }
            Ok(())
        };
        read().map_err(|problem| RecordError::Message {
            channel: self.channel,
            offset: self.offset,
            problem,
        })
    }

    /// The last value of a field; `None` if it is absent.
    fn last<T>(
        &self,
        number: u32,
        of: impl Fn(&Field<'a>) -> Result<T, ProtobufError>,
    ) -> Result<Option<T>, RecordError> {
        let mut last = None;
        self.each(number, |field| {
            last = Some(of(field)?);
            Ok(())
        })?;
        Ok(last)
    }

    fn u64(&self, number: u32) -> Result<u64, RecordError> {
        Ok(self.last(number, Field::to_u64)?.unwrap_or_default())
    }

    fn f64(&self, number: u32) -> Result<Option<f64>, RecordError> {
        self.last(number, Field::to_f64)
    }

    fn text(&self, number: u32) -> Result<Option<String>, RecordError> {
        self.last(number, |field| Ok(field.to_str()?.to_owned()))
    }

    fn vector(&self, number: u32) -> Result<Option<DVec3>, RecordError> {
        self.last(number, |field| {
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
        })
    }

    fn options(&self, number: u32) -> Result<Vec<(String, String)>, RecordError> {
        let mut options = Vec::new();
        self.each(number, |field| {
            let mut option = (String::new(), String::new());
            for inner in field.message()? {
                let inner = inner?;
                match inner.number {
                    1 => option.0 = inner.to_str()?.to_owned(),
                    2 => option.1 = inner.to_str()?.to_owned(),
                    _ => {}
                }
            }
            options.push(option);
            Ok(())
        })?;
        Ok(options)
    }

    /// The values of a repeated field, `None` if there are none; `name` is for the error.
    fn values<const N: usize>(
        &self,
        number: u32,
        name: &'static str,
    ) -> Result<Option<[f64; N]>, RecordError> {
        let (mut values, mut count) = ([0.0; N], 0);
        self.each(number, |field| {
            for value in field.doubles()? {
                if let Some(place) = values.get_mut(count) {
                    *place = value;
                }
                count += 1;
            }
            Ok(())
        })?;
        match count {
            0 => Ok(None),
            _ if count == N => Ok(Some(values)),
            _ => Err(self.wrong(name, COUNT)),
        }
    }

    fn all<const N: usize>(
        &self,
        number: u32,
        name: &'static str,
    ) -> Result<[f64; N], RecordError> {
        let values = self.values(number, name)?;
        values.ok_or_else(|| self.wrong(name, COUNT))
    }

    fn wrong(&self, field: &'static str, problem: &'static str) -> RecordError {
        RecordError::Value {
            channel: self.channel,
            offset: self.offset,
            field,
            problem,
        }
    }

    /// The setup of the session.
    pub(crate) fn setup(&self) -> Result<Setup, RecordError> {
        let nominal = Board::default();
        let name = self.text(4)?.unwrap_or_default();
        let setup = Setup {
            program: self.text(1)?.unwrap_or_default(),
            scene_obj: self.text(2)?.unwrap_or_default(),
            scene_sidecar: self.text(3)?,
            arm: match self.text(5)? {
                Some(text) => ArmSource::Urdf { name, text },
                None => ArmSource::Named(name),
            },
            board: Board {
                half_width_m: self.f64(6)?.unwrap_or(nominal.half_width_m),
                half_height_m: self.f64(7)?.unwrap_or(nominal.half_height_m),
                thickness_m: self.f64(8)?.unwrap_or(nominal.thickness_m),
            },
            options: self.options(9)?,
        };
        match setup.board.validate() {
            Ok(()) => Ok(setup),
            Err(_) => Err(self.wrong("board", "no size that a board can have")),
        }
    }

    /// The number of the message among all of the session, and its contents.
    pub(crate) fn input(&self) -> Result<(u64, Input), RecordError> {
        let input = match self.channel {
            RUN => Input::Run(Run {
                number: self.last(2, Field::to_u32)?.unwrap_or_default(),
                options: self.options(3)?,
            }),
            FRAME => Input::Frame(self.frame()?),
            WORLD => Input::World(self.world()?),
            REQUEST => Input::Request(self.request()?),
            CYCLE => Input::Cycle(self.cycle()?),
            END => Input::End {
                dropped: self.u64(2)?,
            },
            _ => return Err(self.wrong("channel", "no channel of a session")),
        };
        Ok((self.u64(1)?, input))
    }

    fn frame(&self) -> Result<HandFrame, RecordError> {
        let mut frame = HandFrame {
            t_s: self.f64(2)?.unwrap_or_default(),
            head_m: self.vector(9)?,
            gaze: self.vector(10)?,
            other_hand_m: self.vector(OTHER_HAND_FIELD)?,
            bystanders: self.bystanders()?,
            is_of_another: self.u64(ANOTHER_FIELD)? != 0,
            ..HandFrame::default()
        };
        for (number, point) in (3..).zip(HandPoint::ALL) {
            frame.set_point(point, self.vector(number)?);
        }
        for (number, point) in (FIRST_BODY_FIELD..).zip(BodyPoint::ALL) {
            frame.set_body(point, self.vector(number)?);
        }
        Ok(frame)
    }

    fn bystanders(&self) -> Result<Option<Bystanders>, RecordError> {
        let Some(count) = self.u64(BYSTANDERS_FIELD)?.checked_sub(1) else {
            return Ok(None);
        };
        let mut heads_m = Vec::new();
        for place in 1..=count.min(MOST_BYSTANDERS as u64 + 1) as u32 {
            heads_m.push(self.vector(BYSTANDERS_FIELD + place)?);
        }
        let too_many = |_| self.wrong("bystanders", "more than a frame holds");
        Bystanders::new(&heads_m).map(Some).map_err(too_many)
    }

    fn world(&self) -> Result<WorldPose, RecordError> {
        let position_m = self.vector(3)?.unwrap_or_default();
        let rotation = DMat3::from_cols_array(&self.all(4, "rotation_columns")?);
        if Pose::new(rotation, position_m).is_err() {
            return Err(self.wrong("rotation_columns", "no rigid motion"));
        }
        Ok(WorldPose {
            t_s: self.f64(2)?.unwrap_or_default(),
            // `Pose::new` projects a matrix to the nearest rotation, but here its bits count.
            base_from_world: Pose::from_parts_unchecked(rotation, position_m),
        })
    }

    fn request(&self) -> Result<Request, RecordError> {
        Ok(match self.u64(2)? {
            0 => Request::Stop,
            1 => Request::Reset,
            2 => Request::ClockOffset {
                arm_minus_tracker_s: self.f64(3)?.unwrap_or_default(),
            },
            3 => Request::Refused,
            4 => Request::Planned {
                step: self.u64(4)?,
                surfaces: self.u64(5)?,
            },
            5 => Request::Perceived,
            _ => return Err(self.wrong("kind", "no request that is known")),
        })
    }

    fn cycle(&self) -> Result<Cycle, RecordError> {
        let command = || self.all(8, "command_values");
        Ok(Cycle {
            t_s: self.f64(2)?.unwrap_or_default(),
            state: ArmState {
                t_s: self.f64(3)?.unwrap_or_default(),
                q: JointPositions(self.all(4, "q_rad")?),
                qd: JointVelocities(self.all(5, "qd_rad_per_s")?),
                external_torque: self.values(6, "external_torque_n_m")?.map(JointTorques),
            },
            command: match self.u64(7)? {
                0 => ArmCommand::Hold,
                1 => ArmCommand::Position(JointPositions(command()?)),
                2 => ArmCommand::Torque(JointTorques(command()?)),
                _ => return Err(self.wrong("command", "no command that is known")),
            },
        })
    }
}

/// Error of a field with too many or too few values.
const COUNT: &str = "the wrong number of values";
