//! Does the board return more energy than a hand has put in? A million contacts.

pub mod contact;
pub mod document;
mod linear;
pub mod simulation;
pub mod study;
