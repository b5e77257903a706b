//! No more energy comes out of the board than a hand has put into it.
//!
//! One direction at a time: the *port* is where the hand meets the device, its axis points the way in which the hand
//! pushes. [`PassivePort`] is the one way to use what is here; the account, the controller and the tank stand alone too.
//!
//! # Which command is passive
//!
//! A wall that is sampled and delayed gives out more energy than a hand puts in, unless the device's own friction takes it:
//! `b >= K (T/2 + t_d)` (`passivity::required_damping_n_s_per_m`). `PassivePort` makes sure of it for any force law, for both
//! causalities (force out from motion in, and motion out from force in):
//!
//! - The account is kept twice: as it looks, and less all that noise, resolution and interpolation may hide. A constant error
//!   costs nothing while the command does not change, so `still_band` lets a wall that is leaned on stand for ever.
//! - `PassivityMethod::Tank`, the default, lets a command through as far as what has surely gone in pays for the worst that it and the
//!   commands under way may still cost. Nothing comes out that has not gone in before, as long as the port was configured correctly:
//!   period, delay, mass, errors of the sensors, bounds of the hand.
//! - `Controller` is the classic observer with its controller; it repairs after the fact. `Both` damps before the tank refuses.
//!
//! docs/PASSIVITY.md in the repository compares them on random contacts, with delays up to 10 ms, and the formula with
//! simulation. What the tank costs is feel: a wall that is too stiff for its delay becomes softer and gives less back.
//!
//! ```rust
//! use hwall_haptics::passivity::{PassivePort, PortConfig, PortInput, Sampling};
//!
//! let sampling = Sampling { period_s: 1e-3, delay_s: 5e-3 };
//! let mut port = PassivePort::new(PortConfig::impedance(sampling, 2.0))?;
//! let (stiffness, position_m) = (2000.0, 0.001);
//! let wanted: f64 = -stiffness * position_m;
//! let step = port.step(&PortInput {
//!     position_m,
//!     hand_force_n: 0.0,
//!     wanted,
//!     stored_j: Some(0.5 * wanted * wanted / stiffness),
//! })?;
//! assert!(step.command.abs() <= wanted.abs());
//! # Ok::<(), hwall_haptics::HapticsError>(())
//! ```

mod account;
mod controller;
mod design;
mod observer;
mod port;
mod port_config;
mod tank;

pub use controller::{DissipationLimit, PassivityController};
pub use design::{
    DampingDesign, Sampling, effective_mass_kg, largest_stiffness_n_per_m,
    required_damping_n_s_per_m,
};
pub use observer::EnergyObserver;
pub use port::{PassivePort, PortInput, PortOutput};
pub use port_config::{Causality, HandBounds, PassivityMethod, PortConfig};
pub use tank::EnergyTank;
