//! No more energy comes out of the board than a hand has put into it.
//!
//! One direction at a time: the *port* is where the hand meets the device, its axis points the way in which the hand
//! pushes. [`PassivePort`] is the one way to use what is here; the account, the controller and the tank stand alone too.

mod account;
mod controller;
mod design;
mod observer;
mod port;
mod tank;

pub use controller::{DissipationLimit, PassivityController};
pub use design::{
    DampingDesign, Sampling, effective_mass_kg, largest_stiffness_n_per_m,
    required_damping_n_s_per_m,
};
pub use observer::EnergyObserver;
pub use port::{
    Causality, HandBounds, PassivePort, PassivityMethod, PortConfig, PortInput, PortOutput,
};
pub use tank::EnergyTank;
