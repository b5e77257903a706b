//! Does the board return more energy than a hand has put in? Simulates a million contacts.

pub mod contact;
pub mod document;
pub mod simulation;
pub mod study;
