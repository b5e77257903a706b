//! The board delivers no more energy than a hand has put into it.
//!
//! One direction at a time: the *port* is where the hand meets the device; its axis points the way that the hand pushes. [`PassivePort`] combines
//! everything here; energy balance, controller and tank can also be used alone.
//!
//! # Which command is passive
//!
//! A sampled, delayed wall delivers more energy than a hand puts in, unless the device's own friction dissipates it: `b >= K (T/2 + t_d)`
//! (`passivity::required_damping_n_s_per_m`). `PassivePort` enforces passivity for any force law and both causalities (motion in and force out, or
//! force in and motion out):
//!
//! - There are two energy balances: the observed one, and the guaranteed one, which subtracts all that noise, resolution and interpolation may hide.
//!   A constant error costs nothing while the command does not change, so with `still_band` a wall that is leaned on stands forever.
//! - `PassivityMethod::Tank`, the default, passes a command as far as the guaranteed energy pays for the worst that it and the pending commands may
//!   still cost. Energy comes out only after it has gone in, provided that the port is configured correctly: period, delay, mass, sensor errors,
//!   bounds of the hand.
//! - `Controller` is the classic passivity observer and controller; it acts afterwards. `Both` damps before the tank refuses.
//!
//! docs/PASSIVITY.md in the repository compares them on random contacts, with delays up to 10 ms, and the formula with simulation. The tank changes
//! the feel: a wall that is too stiff for its delay becomes softer and returns less energy.
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
pub use design::{DampingDesign, Sampling, effective_mass_kg, required_damping_n_s_per_m};
pub use observer::EnergyObserver;
pub use port::{PassivePort, PortInput, PortOutput};
pub use port_config::{Causality, HandBounds, PassivityMethod, PortConfig};
pub use tank::EnergyTank;
