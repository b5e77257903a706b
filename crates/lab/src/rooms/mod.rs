//! Predictors with a scene: simulated people who touch the surfaces of rooms.

pub mod contenders;
pub mod objects;
pub mod people;
pub mod room;
pub mod scores;
pub mod study;
