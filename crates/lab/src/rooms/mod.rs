//! Predictors with a scene: simulated people who touch the surfaces of rooms.

pub mod contenders;
pub mod figures;
pub mod people;
pub mod registration;
pub mod room;
pub mod rows;
pub mod scores;
pub mod setting;
pub mod study;
pub mod tables;
