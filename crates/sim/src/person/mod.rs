//! A person who reaches, looks and touches, seeded.
//!
//! # The reach
//!
//! Rest, look, dwell, reach, press, hold, withdraw. Along the normal the reach is one minimum-jerk movement to a depth beyond the
//! surface; along the surface it is another one that is over at contact, with a slight bow. So the hand still moves at contact, and
//! true crossings of the surface lie within the tremor (0.3 mm) of the target, whatever traits are on.
//!
//! # What makes people differ
//!
//! `PersonConfig::default()` is somebody plain: pace, bow, hand size and tremor are the person's own, the rest is as in a
//! textbook. `PersonConfig::varied()` switches on what makes prediction hard; each field can be set alone. `fast()` and `slow()` are plain
//! people of another pace, `glancing()` plain people who look around. `TouchTruth` says when the gaze landed on the target.
//!
//! | trait | how |
//! | --- | --- |
//! | speed profile | time is warped, so that the peak comes early or late (0.3 to 0.7 of the time) |
//! | correction | the first movement falls short and aside, a second one overlaps it and corrects that: the sum of two such movements |
//! | movement time | grows with a power of the distance: 0.5 keeps the same peak acceleration |
//! | gesture | pointing, flat all the time, or clenched at rest and opening on approach; grasping if asked for |
//! | posture, rests, head, lean | scatter from person to person and from reach to reach |
//! | gaze | leads, is off, misses the reach altogether, or leaves shortly before the contact |
//! | tracker | noise, and points that are lost for a while, each on its own |
//! | glances | between touches the gaze visits places that are not touched, and sometimes goes back: `PersonConfig::glancing()`, `Person::plan_looking` |
//! | change of mind | `Person::plan_reaches`: the hand glides over to the other target; `TouchTruth::changed` tells |
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
