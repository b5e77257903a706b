//! A base that drives: its motion, its distance from a person, where it has to stand, and when to go there.

mod choice;
mod drive;
mod inversion;
mod person;
mod route;

pub use choice::{BaseChoiceConfig, BaseChooser, BaseHypothesis};
pub use drive::{BaseDrive, BaseLimits, BasePose, BaseState};
pub use inversion::{BaseInversion, BaseInversionConfig};
pub use person::{BasePart, BaseSafety, SeenHand, Surroundings};
pub use route::{KeepOutArea, route};
