//! A ready-made control loop.

use super::Session;
use super::world::WorldPose;
use hwall_contact::Predictor;
use hwall_hand::HandFrame;
use hwall_haptics::{Arm, ArmCommand, ArmState};

/// Environment of a loop: time, the tracker, the virtual world.
///
/// On a real system, [`Surroundings::next_cycle`] waits until the next cycle of the arm begins.
pub trait Surroundings<R: Arm> {
    /// Waits for the next cycle and returns its time on the clock of the arm, s; `None` ends the loop.
    ///
    /// # Errors
    /// Any error ends the loop, and the arm is commanded to hold.
    fn next_cycle(&mut self, arm: &mut R) -> Result<Option<f64>, R::Error>;

    /// The next frame of the tracker that has arrived and was not yet returned.
    fn next_frame(&mut self, _now_s: f64) -> Option<HandFrame> {
        None
    }

    /// The pose of the virtual world, if it has changed; not needed for a static world.
    fn next_world(&mut self, _now_s: f64) -> Option<WorldPose> {
        None
    }

    /// The state of the arm, as the controller is to see it; by default unchanged.
    fn state(&mut self, state: ArmState) -> ArmState {
        state
    }

    /// Reports that the arm did not take a command, and why; the loop continues.
    fn refused(&mut self, _reason: &R::Error) {}
}

/// Answers the state of an arm with a command, once in every cycle.
pub trait Controller {
    /// A frame of the tracker came in.
    fn frame(&mut self, _frame: &HandFrame) {}

    /// The virtual world moved.
    fn world(&mut self, _pose: &WorldPose) {}

    /// The command for the coming cycle; times on the clock of the arm, s.
    fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand;

    /// Does what takes longer than a step, in the rest of the cycle.
    fn plan(&mut self) {}

    /// The arm did not take the command of this cycle ([`Arm::is_transient`]); the loop continues.
    fn refused(&mut self) {}

    /// The arm is gone, gave no state, or the loop ends with another error.
    fn failed(&mut self) {}
}

/// What one cycle of [`drive`] did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Time of the cycle on the clock of the arm, s.
    pub t_s: f64,
    /// The state that the command answers.
    pub state: ArmState,
    /// The command that was sent.
    pub command: ArmCommand,
}

/// Runs the loop until the surroundings end it: frames in, state in, command out, once in every cycle. `after` is called at the end of each
/// cycle: to take events, to write a recording, to advance a simulated arm.
///
/// # Errors
/// The first error of the arm, its surroundings or `after`. A command that the arm temporarily does not take is not an error: the session
/// then holds. Before the loop ends, the arm is commanded to hold. The arm may no longer receive that command, so a driver must stop its
/// arm by itself when no commands come.
pub fn drive<C, R, S>(
    controller: &mut C,
    arm: &mut R,
    surroundings: &mut S,
    mut after: impl FnMut(&mut C, &mut R, &mut S, &Cycle) -> Result<(), R::Error>,
) -> Result<(), R::Error>
where
    C: Controller + ?Sized,
    R: Arm,
    S: Surroundings<R> + ?Sized,
{
    loop {
        let done = match cycle(controller, arm, surroundings) {
            Ok(Some(done)) => after(controller, arm, surroundings, &done),
            // The last command may be an unfinished motion.
            Ok(None) => {
                return match arm.command(ArmCommand::Hold) {
                    // An arm that takes no commands already holds.
                    Err(error) if R::is_transient(&error) => Ok(()),
                    held => held,
                };
            }
            Err(error) => Err(error),
        };
        if let Err(error) = done {
            controller.failed();
            // Report the first error; a second one would only say that the arm does not answer.
            let _ = arm.command(ArmCommand::Hold);
            return Err(error);
        }
    }
}

fn cycle<C, R, S>(
    controller: &mut C,
    arm: &mut R,
    surroundings: &mut S,
) -> Result<Option<Cycle>, R::Error>
where
    C: Controller + ?Sized,
    R: Arm,
    S: Surroundings<R> + ?Sized,
{
    let Some(now_s) = surroundings.next_cycle(arm)? else {
        return Ok(None);
    };
    if let Some(pose) = surroundings.next_world(now_s) {
        controller.world(&pose);
    }
    while let Some(frame) = surroundings.next_frame(now_s) {
        controller.frame(&frame);
    }
    let state = surroundings.state(arm.state()?);
    let command = controller.step(now_s, &state);
    match arm.command(command) {
        Err(error) if R::is_transient(&error) => {
            controller.refused();
            surroundings.refused(&error);
        }
        taken => taken?,
    }
    controller.plan();
    Ok(Some(Cycle {
        t_s: now_s,
        state,
        command,
    }))
}

impl<P: Predictor> Controller for Session<P> {
    fn frame(&mut self, frame: &HandFrame) {
        Self::frame(self, frame);
    }

    fn world(&mut self, pose: &WorldPose) {
        // A rejected pose is also reported as an event.
        let _ = Self::world(self, pose);
    }

    fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        Self::step(self, now_s, state)
    }

    fn plan(&mut self) {
        Self::plan(self);
    }

    fn refused(&mut self) {
        Self::refused(self);
    }

    fn failed(&mut self) {
        self.stop();
    }
}
