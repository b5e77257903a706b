//! A simulated person who looks, reaches and touches, seeded.
//!
//! # The reach
//!
//! Phases: rest, look, dwell, reach, press, hold, withdraw. Along the normal the reach is a minimum-jerk movement to a depth beyond
//! the surface; along the surface it is another one that ends at contact, with a slight bow. So the hand still moves at contact,
//! and it crosses the surface within the tremor (0.3 mm) of the target, for all traits.
//!
//! # What makes people differ
//!
//! `PersonConfig::default()` is a nominal person: speed, bow, hand size and tremor are individual, everything else is the textbook value.
//! `PersonConfig::varied()` enables all traits that make prediction hard; each field can also be set alone. `fast()` and `slow()` are nominal
//! people with another speed; `glancing()` gives nominal people who look around. `TouchTruth` gives the time at which the gaze landed on the
//! target.
//!
//! | trait | how |
//! | --- | --- |
//! | speed profile | time is warped, so that the peak comes early or late (0.3 to 0.7 of the time) |
//! | correction | the first movement falls short and to one side; a second one overlaps with it and corrects the error; the path is the sum of both |
//! | movement time | grows with a power of the distance: 0.5 keeps the same peak acceleration |
//! | gesture | pointing, flat all the time, or clenched at rest and opening on approach; grasping, pushing and stroking on request |
//! | posture, rests, head, lean | scatter from person to person and from reach to reach |
//! | gaze | leads, is inaccurate, misses the target throughout a reach, or leaves shortly before the contact |
//! | tracker | noise, and points that are lost for a while, independently |
//! | glances | between touches the gaze visits places that are not touched, and sometimes returns to one of them: `PersonConfig::glancing()`, `Person::plan_looking` |
//! | change of mind | `Person::plan_reaches`: the hand glides over to the other target; `TouchTruth::changed` reports it |
//!
//! ```rust
//! use glam::DVec3;
//! use hwall_sim::{PersonConfig, Population, TouchPlan};
//!
//! let plan = TouchPlan { target_m: DVec3::new(0.6, 0.0, 0.5), normal: DVec3::X };
//! let people = Population::new(PersonConfig::varied(), 1)?;
//! for i in 0..3 {
//!     let reaches = people.person(i).plan(&[plan; 5])?;
//!     let truth = reaches.touches()[0];
//!     let seen = reaches.tracked(truth.start_s); // points may be missing
//!     assert!(seen.head_m.is_some() && truth.contact_s > truth.start_s);
//! }
//! # Ok::<(), hwall_sim::SimError>(())
//! ```

mod bisect;
mod config;
mod draw;
mod gaze;
mod gesture;
mod glances;
mod habits;
mod plan;
mod planned_touch;
mod population;
mod profile;
mod reach;
mod sequence;

pub use config::PersonConfig;
pub use gesture::Gesture;
pub use glances::Glance;
pub use habits::Person;
pub use population::Population;
pub use profile::minimum_jerk;
pub use reach::{ChangeOfMind, ReachPlan, TouchPlan, TouchTruth};
pub use sequence::{PersonSample, TouchSequence};
