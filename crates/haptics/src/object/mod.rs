//! What a virtual object with one degree of freedom does when a hand pushes it: doors, panels, drawers, buttons.
//!
//! A [`MovingObject`] is the mechanics in its own coordinate, an [`ObjectPath`] says what that coordinate means in space.

mod config;
mod force;
mod moving;
mod oscillator;
mod path;

pub use config::{Click, Detent, ObjectConfig};
pub use moving::MovingObject;
pub use path::ObjectPath;
