//! Runs recorded inputs again and compares the commands.

use crate::error::RecordError;
use crate::file::Ending;
use crate::input::{Input, Request};
use crate::recording::{Inputs, Recording};
use crate::setup::{Run, Setup};
use hwall::contact::Predictor;
use hwall::haptics::{ArmCommand, PlannerConfig};
use hwall::{Controller, Session};
use std::collections::VecDeque;
use std::fmt;

/// Passes a request to a session.
pub(crate) fn tell<P: Predictor>(session: &mut Session<P>, request: Request) {
    match request {
        Request::Stop => session.stop(),
        Request::Reset => session.reset(),
        Request::Refused => session.refused(),
        // Handled by the planner.
        Request::Planned { .. } => {}
        // The session rejects now what it rejected in the recording.
        Request::ClockOffset {
            arm_minus_tracker_s,
        } => {
            let _ = session.set_clock_offset_s(arm_minus_tracker_s);
        }
        Request::Perceived => session.take_perceived(),
    }
}

/// The first command that differs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Number of the run.
    pub run: u32,
    /// Number of the cycle in it, from 0.
    pub cycle: u64,
    /// Its time on the arm's clock, s.
    pub t_s: f64,
    /// The recorded command.
    pub recorded: ArmCommand,
    /// The replayed command.
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

/// Result of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Replayed {
    /// Number of sessions.
    pub runs: u64,
    /// Number of tracker frames.
    pub frames: u64,
    /// Number of commands compared.
    pub cycles: u64,
    /// Messages missing in the recording: they were dropped when writing fell behind.
    pub missing: u64,
    /// The first command that differs; nothing after it was compared.
    pub difference: Option<Difference>,
    /// How the recording ends.
    pub ending: Ending,
}

/// Runs the sessions of a recording again, each created by `session_of`, and compares every command bit by bit with the recorded one. Ends
/// at the first difference.
///
/// # Errors
/// A message that cannot be read; an error of `session_of`.
pub fn replay<P: Predictor, E: From<RecordError>>(
    recording: &Recording,
    mut session_of: impl FnMut(&Setup, &Run) -> Result<Session<P>, E>,
) -> Result<Replayed, E> {
    let mut replayed = Replayed {
        runs: 0,
        frames: 0,
        cycles: 0,
        missing: 0,
        difference: None,
        ending: recording.ending(),
    };
    let mut under_way: Option<(Session<P>, u32, u64)> = None;
    let mut plans = Plans::default();
    let mut expected = 0;
    let mut inputs = recording.inputs();
    while let Some(input) = inputs.next() {
        let (sequence, input) = input?;
        replayed.missing += sequence.saturating_sub(expected);
        expected = sequence.saturating_add(1);
        if let Input::Run(run) = &input {
            let mut session = session_of(recording.setup(), run)?;
            if of_run(inputs.clone()).any(|i| matches!(i, Input::Request(Request::Perceived))) {
                session = session.perceive_when_told();
            }
            plans = Plans::of_run(inputs.clone());
            if let Some(planner) = session.planner_mut().filter(|_| plans.are_recorded) {
                planner.set_config(PlannerConfig::on_thread());
            }
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
                plans.go_on(session);
                replayed.frames += 1;
            }
            Input::World(world) => {
                Controller::world(session, &world);
                plans.go_on(session);
            }
            Input::Request(Request::Planned { .. }) => plans.tell(session),
            Input::Request(request) => tell(session, request),
            Input::Cycle(recorded) => {
                let command = session.step(recorded.t_s, &recorded.state);
                match plans.are_recorded {
                    true => plans.go_on(session),
                    false => session.plan(),
                }
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
            // Messages dropped at the very end leave no gap.
            Input::End { dropped } => replayed.missing = replayed.missing.max(dropped),
            Input::Run(_) => {}
        }
    }
    Ok(replayed)
}

/// The inputs of the run that starts.
fn of_run(inputs: Inputs<'_>) -> impl Iterator<Item = Input> {
    inputs.map_while(|input| match input {
        Ok((_, Input::Run(_))) | Err(_) => None,
        Ok((_, input)) => Some(input),
    })
}

/// Repeats on one thread the requests to a planner on its own thread, and the times at which its results were used.
#[derive(Default)]
struct Plans {
    are_recorded: bool,
    /// Unanswered requests: steps, with the surfaces that the planner used.
    ahead: VecDeque<[u64; 2]>,
    has_listened: bool,
    has_worked: bool,
}

impl Plans {
    /// The requests of the run that starts.
    fn of_run(inputs: Inputs<'_>) -> Self {
        let planned = |input| match input {
            Input::Request(Request::Planned { step, surfaces }) => Some([step, surfaces]),
            _ => None,
        };
        let ahead: VecDeque<_> = of_run(inputs).filter_map(planned).collect();
        Self {
            are_recorded: !ahead.is_empty(),
            ahead,
            ..Self::default()
        }
    }

    /// Requests a plan for the next step, and lets the planner work once it has the surfaces that it used in the recording.
    fn go_on<P: Predictor>(&mut self, session: &mut Session<P>) {
        let Some([step, surfaces]) = self.ahead.front() else {
            return;
        };
        if let Some(planner) = session.planner_mut() {
            self.has_listened |= planner.is_asked_about(*step) && planner.listen() == Some(*step);
        }
        if !self.has_listened || self.has_worked {
            return;
        }
        while session.perception().told_surfaces() < *surfaces {
            if !session.perceive_next() {
                return;
            }
        }
        if let Some(planner) = session.planner_mut() {
            planner.work();
            self.has_worked = true;
        }
    }

    fn tell<P: Predictor>(&mut self, session: &mut Session<P>) {
        if let Some(planner) = session.planner_mut().filter(|_| self.has_worked) {
            planner.tell();
        }
        self.ahead.pop_front();
        (self.has_listened, self.has_worked) = (false, false);
    }
}

/// Name and numbers of a command.
fn parts(command: &ArmCommand) -> (&'static str, [f64; 7]) {
    match command {
        ArmCommand::Position(q) => ("position", q.0),
        ArmCommand::Torque(torque) => ("torque", torque.0),
        _ => ("hold", [0.0; 7]),
    }
}

/// Compares bit by bit: zero differs from minus zero, and NaN equals itself.
fn same(a: &ArmCommand, b: &ArmCommand) -> bool {
    let ((kind_a, a), (kind_b, b)) = (parts(a), parts(b));
    kind_a == kind_b && a.map(f64::to_bits) == b.map(f64::to_bits)
}
