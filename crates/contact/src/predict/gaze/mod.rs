//! What the gaze says about the next contact: looks, how people look, and how that is learnt.

pub(in crate::predict) mod idle;
mod maximisation;
pub(in crate::predict) mod memory;
pub(in crate::predict) mod model;
mod resting_hand;
mod shares;
mod training;
pub(in crate::predict) mod weights;

pub use model::GazeModel;
pub use resting_hand::RestingHand;
pub use shares::{LOOK_AGES_S, LookShares, LookTable, TargetShares};
pub use training::{LabelledStream, StreamContact, StreamFilters};
