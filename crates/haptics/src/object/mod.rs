//! Virtual objects with one degree of freedom that a hand can push: doors, panels, drawers, buttons.
//!
//! [`MovingObject`] is the mechanics in its own coordinate; [`ObjectPath`] maps that coordinate to space.
//!
//! # How an object moves
//!
//! `inertia · a = force − stiffness · (x − rest) − damping · v − friction · sign(v) + latches + click`, between stops. `x` is an
//! angle or a distance.
//!
//! ```rust
//! use hwall_haptics::glam::DVec3;
//! use hwall_haptics::kinematics::Wrench;
//! use hwall_haptics::{Detent, MovingObject, ObjectConfig, ObjectPath};
//!
//! // A door of 20 kg and 0.8 m with a latch, pushed with 12 N at its handle for half a second.
//! let latch = Detent { position: 0.0, half_width: 0.035, force: 3.0 };
//! let mut door = MovingObject::new(ObjectConfig {
//!     damping: 1.0,
//!     friction: 0.5,
//!     range: [0.0, 1.5],
//!     detents: vec![latch],
//!     ..ObjectConfig::new(4.3)
//! })?;
//! let path = ObjectPath::turning(DVec3::new(0.6, 0.2, 0.0), DVec3::Z)?;
//! let handle_m = DVec3::new(0.6, -0.5, 0.4);
//! let push = Wrench { force_n: DVec3::X * 12.0, ..Wrench::default() };
//! door.step(path.generalized_force(handle_m, &push), 0.5)?;
//! assert!(door.position() > latch.half_width);
//! door.step(0.0, 60.0)?;
//! assert_eq!(door.velocity(), 0.0);
//! # Ok::<(), hwall_haptics::HapticsError>(())
//! ```
//!
//! - A step is the exact solution for a constant force, for 1 µs as for 10 s: between events (a reversal, a stop, an edge of a latch or click) the
//!   motion has a closed form, and events are located to rounding. Where the whole motion has a closed form, tests agree to 1e-12.
//! - Friction holds an object at rest exactly in place, up to and including the breakaway force.
//! - A stop takes all speed, or returns a share of it (`restitution`). Rebounds below 1e-12 are dropped.
//! - A latch (`Detent`) is a spring that lets go at its edge. A click lets go at its snap and returns at its release: the energy between them is lost
//!   in each click, as in a real key.
//! - No step generates energy: `energy_j` never grows by more than force times distance (a million random steps, 1 µs to 10 s, on 25,000 random
//!   objects).
//!
//! `cargo bench -p hwall-haptics` prints the cost of a 1 ms step while a hand changes its push or pull every 50 ms, and the difference between a
//! thousand such steps and one of 1 s (AMD EPYC, two cores, busy with other work):
//!
//! | object | median ns | p99 ns | difference, rad or m |
//! | --- | --- | --- | --- |
//! | free mass | 38 | 41 | 4.4e-16 |
//! | door with a closer | 96 | 104 | 1.1e-16 |
//! | the same, friction and latch | 93 | 113 | 3.3e-16 |
//! | button with a click | 64 | 124 | 0 |
//! | bouncing door | 97 | 104 | 3.3e-16 |
//!
//! Not modelled: several degrees of freedom, static friction above kinetic friction, and latches whose force falls gradually at the edge.

mod config;
mod force;
mod moving;
mod oscillator;
mod path;

pub use config::{Click, Detent, ObjectConfig};
pub use moving::MovingObject;
pub use path::ObjectPath;
