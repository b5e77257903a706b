//! What surrounds the arm of a study.

use hwall::contact::Predictor;
use hwall::haptics::Arm;
use hwall::{Cycle, Event, Session, Surroundings};

/// Time, the tracker, and whoever looks on.
pub trait StudyRoom<R: Arm>: Surroundings<R> {
    /// Something happened.
    fn event(&mut self, _event: &Event) {}

    /// A cycle was done: to show it, to advance a simulated arm, to [stop](Session::stop) the session or to [let it go](Session::reset).
    ///
    /// # Errors
    /// Any error ends the arm's part in the study.
    fn after<P: Predictor>(
        &mut self,
        _session: &mut Session<P>,
        _arm: &mut R,
        _cycle: &Cycle,
    ) -> Result<(), R::Error> {
        Ok(())
    }

    /// The loop has ended and the arm was told to hold: to brake one that needs more than one command for that.
    fn ended(&mut self, _arm: &mut R) {}
}
