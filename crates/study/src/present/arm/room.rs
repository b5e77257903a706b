//! Surroundings of the arm in a study.

use hwall::contact::Predictor;
use hwall::haptics::Arm;
use hwall::{Cycle, Event, Session, Surroundings};

/// Clock, tracker and observers.
pub trait StudyRoom<R: Arm>: Surroundings<R> {
    /// Receives an event of the session.
    fn event(&mut self, _event: &Event) {}

    /// Called after every cycle: to display it, to advance a simulated arm, to [stop](Session::stop) the session or to [reset](Session::reset) it.
    ///
    /// # Errors
    /// Any error ends the loop of the arm.
    fn after<P: Predictor>(
        &mut self,
        _session: &mut Session<P>,
        _arm: &mut R,
        _cycle: &Cycle,
    ) -> Result<(), R::Error> {
        Ok(())
    }

    /// Called after the loop has ended and commanded a hold: for arms that need several commands to brake.
    fn ended(&mut self, _arm: &mut R) {}
}
