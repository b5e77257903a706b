//! Does the board give out more energy than a hand has put in? Largest stiffness, and a million contacts.

pub mod contact;
pub mod cost;
pub mod document;
pub mod figures;
mod linear;
pub mod simulation;
pub mod study;
pub mod z_width;
