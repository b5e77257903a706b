//! Errors of a simulated arm.

use hwall_fri::FriError;
use hwall_sim::SimError;

/// An error of a simulated arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// From the arm.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// From the interface.
    #[error(transparent)]
    Fri(#[from] FriError),
}
