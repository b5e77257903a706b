//! Environments far larger than the room: which touches can one fixed arm present, and what does redirection add?

pub mod document;
mod figures;
mod gym;
mod journey;
mod modes;
mod outcome;
mod participant;
mod presenter;
mod speed;
pub mod study;
mod ways;
