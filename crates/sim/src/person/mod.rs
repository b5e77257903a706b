//! A person who reaches, looks and touches, seeded.

mod bisect;
mod config;
mod draw;
mod gaze;
mod gesture;
mod glances;
mod habits;
mod plan;
mod planned_touch;
mod population;
mod profile;
mod reach;
mod sequence;

pub use config::PersonConfig;
pub use gesture::Gesture;
pub use glances::Glance;
pub use habits::Person;
pub use population::Population;
pub use profile::minimum_jerk;
pub use reach::{ChangeOfMind, ReachPlan, TouchPlan, TouchTruth};
pub use sequence::{PersonSample, TouchSequence};
