//! From targets of the board to joint commands within the arm's limits.
//!
//! # How the board stays behind the surfaces
//!
//! `Renderer::set_barriers` sets the surfaces; the presented surface always counts. A path is checked before the motion begins. The straight path is
//! taken if the corners and the centre of the face stay behind the surfaces (3 mm are allowed). Otherwise the planner bends the path at its worst
//! point, along the gradient of the distance. If that fails, the path passes a point behind the goal or behind the board, or stops there. The
//! quickest path that stays behind is taken. If there is none, the board completes its current motion, which is safe, and stands still
//! (`Follower::is_blocked`); the search is repeated after `ApproachConfig::retry_s`. A step checks a bounded number of samples (`Follower::samples`); a
//! longer search continues in the next steps.
//!
//! The surface nearest to a point decides on which side the point is. Beside a shelf the board is therefore behind the wall, not in front of the
//! shelf's plane. Over the face at a place that the board serves or leaves, only that face counts; the other surfaces count progressively more within
//! a margin around it (`ApproachConfig::footprint_m`).
//!
//! Paths also keep clear of the room, of the arm itself, and of the last known position of the person (`body::Separation`).
//!
//! Limits: only the centre and corners of the face are kept behind surfaces, not the arm (see `Follower::link_in_front`). With targets that change at
//! random the face comes at most 5 mm in front of two walls. With a box on the wall that bound holds in 99 of 100 steps; in the others the face comes
//! up to 0.1 m in front of the wall, because a goal may change while the board is in the box (bounds of tests/it/approach.rs).
//!
//! Without `BoardTarget::near` the goal is chosen near the last one and may come close to joint limits and singular poses. Where a drifting target
//! runs into a limit (a vertical wall at shoulder height makes shoulder and wrist singular together), the board goes to another roll or arm posture,
//! with up to radians of joint travel.
//!
//! A slide looks ahead only as far as its stopping distance. In 3 of 88 touches at 80 mm/s with a turn of 20 degrees, the board missed its speed for
//! some 50 ms and its plane by up to 1.4 mm, probably because a joint met its limit or a singular pose some centimetres ahead (not traced).

mod approach_config;
mod barrier;
mod between;
mod follower;
mod follower_config;
mod goal;
mod goals;
mod link;
mod planner;
mod preposition;
mod profile;
mod route;
mod search;
mod slide;
mod solver;
mod way;

pub use approach_config::ApproachConfig;
pub use barrier::Barrier;
pub use barrier::links::LinkInFront;
pub use barrier::tree::BarrierTree;
pub use follower::Follower;
pub use follower_config::FollowerConfig;
pub use planner::{Planner, PlannerConfig};
pub use preposition::PREPOSITION_SHARE;
pub use slide::Slide;
