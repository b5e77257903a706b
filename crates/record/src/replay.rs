//! The same inputs once more, and whether the same commands come out.

use crate::error::RecordError;
use crate::file::Ending;
use crate::recording::{Input, Recording, Request};
use crate::setup::{Run, Setup};
use hwall::contact::Predictor;
use hwall::haptics::ArmCommand;
use hwall::{Controller, Session};
use std::fmt;

/// A controller that takes requests: all that a recording holds.
pub trait Replayable: Controller {
    /// Tells it something.
    fn request(&mut self, request: Request);
}

impl<P: Predictor> Replayable for Session<P> {
    fn request(&mut self, request: Request) {
        match request {
            Request::Stop => self.stop(),
            Request::Reset => self.reset(),
            Request::Refused => self.refused(),
            // What the session refused then it refuses now.
            Request::ClockOffset {
                arm_minus_tracker_s,
            } => {
                let _ = self
                    .perception_mut()
                    .set_clock_offset_s(arm_minus_tracker_s);
            }
        }
    }
}

/// The first command that came out differently.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Number of the run.
    pub run: u32,
    /// Number of the cycle in it, from 0.
    pub cycle: u64,
    /// Its time on the arm's clock, s.
    pub t_s: f64,
    /// As the recording has it.
    pub recorded: ArmCommand,
    /// As it is now.
    pub replayed: ArmCommand,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "run {}, cycle {} at {:.3} s: ",
            self.run, self.cycle, self.t_s
        )?;
        let ((was, old), (is, new)) = (parts(&self.recorded), parts(&self.replayed));
        if was != is {
            return write!(f, "recorded {was}, now {is}");
        }
        let mut joints = old.iter().zip(&new).enumerate();
        match joints.find(|(_, (a, b))| a.to_bits() != b.to_bits()) {
            Some((joint, (a, b))) => {
                write!(f, "{was} of joint {}: recorded {a:?}, now {b:?}", joint + 1)
            }
            None => Ok(()),
        }
    }
}

/// What a replay found.
#[derive(Debug, Clone, PartialEq)]
pub struct Replayed {
    /// Sessions.
    pub runs: u64,
    /// Frames of the tracker.
    pub frames: u64,
    /// Commands that were compared.
    pub cycles: u64,
    /// Messages that the recording lacks: those left out when writing fell behind.
    pub missing: u64,
    /// The first command that differs; nothing after it was compared.
    pub difference: Option<Difference>,
    /// How the recording ends.
    pub ending: Ending,
}

/// Runs the sessions of a recording again, each made by `session_of`, and compares every command bit by bit with the
/// one that was recorded. Ends at the first difference.
///
/// # Errors
/// A message that cannot be read; an error of `session_of`.
pub fn replay<C: Replayable, E: From<RecordError>>(
    recording: &Recording,
    mut session_of: impl FnMut(&Setup, &Run) -> Result<C, E>,
) -> Result<Replayed, E> {
    let mut replayed = Replayed {
        runs: 0,
        frames: 0,
        cycles: 0,
        missing: 0,
        difference: None,
        ending: recording.ending(),
    };
    let mut under_way: Option<(C, u32, u64)> = None;
    let mut expected = 0;
    for input in recording.inputs() {
        let (sequence, input) = input?;
        replayed.missing += sequence.saturating_sub(expected);
        expected = sequence.saturating_add(1);
        if let Input::Run(run) = &input {
            let session = session_of(recording.setup(), run)?;
            under_way = Some((session, run.number, 0));
            replayed.runs += 1;
            continue;
        }
        let Some((session, run, cycle)) = &mut under_way else {
            continue;
        };
        match input {
            Input::Frame(frame) => {
                session.frame(&frame);
                replayed.frames += 1;
            }
            Input::World(world) => session.world(&world),
            Input::Request(request) => session.request(request),
            Input::Cycle(recorded) => {
                let command = session.step(recorded.t_s, &recorded.state);
                session.plan();
                replayed.cycles += 1;
                if !same(&command, &recorded.command) {
                    replayed.difference = Some(Difference {
                        run: *run,
                        cycle: *cycle,
                        t_s: recorded.t_s,
                        recorded: recorded.command,
                        replayed: command,
                    });
                    return Ok(replayed);
                }
                *cycle += 1;
            }
            // Those left out at the very end leave no gap behind them.
            Input::End { dropped } => replayed.missing = replayed.missing.max(dropped),
            Input::Run(_) => {}
        }
    }
    Ok(replayed)
}

/// What a command is called, and its numbers.
fn parts(command: &ArmCommand) -> (&'static str, [f64; 7]) {
    match command {
        ArmCommand::Position(q) => ("position", q.0),
        ArmCommand::Torque(torque) => ("torque", torque.0),
        _ => ("hold", [0.0; 7]),
    }
}

/// Bit by bit: neither is zero minus zero, nor does NaN differ from itself.
fn same(a: &ArmCommand, b: &ArmCommand) -> bool {
    let ((kind_a, a), (kind_b, b)) = (parts(a), parts(b));
    kind_a == kind_b && a.map(f64::to_bits) == b.map(f64::to_bits)
}
