//! Whatever presents stimuli.

use super::simulated::SimulatedStage;
use super::stimulus::{Rendered, Stimulus};
use crate::error::StudyError;
use crate::protocol::ArmKind;

/// Presents stimuli: an arm, real or simulated.
pub trait Presenter {
    /// Presents a stimulus once and says what was rendered; `seed` for what is left to chance.
    ///
    /// # Errors
    /// What keeps the study from going on. A trial that is spoilt is no error: its [`Rendered::fault`] says so.
    fn present(&mut self, stimulus: &Stimulus, seed: u64) -> Result<Rendered, StudyError>;

    /// More words about why the last touch was spoilt, once; none by default.
    fn because(&mut self) -> Option<String> {
        None
    }

    /// Which kind of arm it presents with; the simulated one by default.
    fn arm(&self) -> ArmKind {
        ArmKind::Simulated
    }
}

impl Presenter for SimulatedStage {
    fn present(&mut self, stimulus: &Stimulus, seed: u64) -> Result<Rendered, StudyError> {
        Self::present(self, stimulus, seed)
    }
}
