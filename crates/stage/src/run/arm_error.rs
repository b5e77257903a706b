//! What a simulated arm refuses.

use hwall_fri::FriError;
use hwall_sim::SimError;

/// What a simulated arm refuses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// The arm.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The interface.
    #[error(transparent)]
    Fri(#[from] FriError),
}
