//! Interface for presenting stimuli.

use super::simulated::SimulatedStage;
use super::stimulus::{Rendered, Stimulus};
use crate::error::StudyError;
use crate::protocol::ArmKind;

/// Presents stimuli: an arm, real or simulated.
pub trait Presenter {
    /// Presents a stimulus once and returns what was rendered; `seed` for random parts.
    ///
    /// # Errors
    /// Failures that stop the study. A spoilt trial is not an error; see [`Rendered::fault`].
    fn present(&mut self, stimulus: &Stimulus, seed: u64) -> Result<Rendered, StudyError>;

    /// Details of why the last touch was spoilt, returned once; none by default.
    fn because(&mut self) -> Option<String> {
        None
    }

    /// Kind of arm; simulated by default.
    fn arm(&self) -> ArmKind {
        ArmKind::Simulated
    }
}

impl Presenter for SimulatedStage {
    fn present(&mut self, stimulus: &Stimulus, seed: u64) -> Result<Rendered, StudyError> {
        Self::present(self, stimulus, seed)
    }
}
