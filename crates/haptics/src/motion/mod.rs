//! From places of the board to joint commands within the limits of the arm.
//!
//! # How the board stays behind the surfaces
//!
//! `Renderer::set_barriers` sets the surfaces; the one that is presented always counts. A way is checked before it is begun. The
//! straight one is taken if corners and middle of the face stay behind (3 mm are allowed). Otherwise it is bent where it is worst,
//! along the gradient of the distance; otherwise it passes a place behind the goal or behind the board, or stops there. Of the ways
//! that stay behind, the quickest is taken. If none does, the board completes the motion under way, which is safe, and stands
//! (`Follower::is_blocked`); the search is repeated after `ApproachConfig::retry_s`. A step checks a bounded number of instants of
//! ways (`Follower::looks`); a search that needs more goes on in the next steps, while the motion under way goes on.
//!
//! The surface nearest to a point decides on which side the point is. Beside a shelf the board is therefore behind the wall, not in
//! front of the shelf's plane. Over the face at a place that it serves or leaves only that face counts, and around it the others
//! less and less (`ApproachConfig::footprint_m`).
//!
//! Ways also keep clear of the room, of the arm itself, and of the person as last seen (`body::Separation`).
//!
//! Limits: only middle and corners of the face are kept behind surfaces, not the arm (`Follower::link_in_front` tells), and ways are checked every 12 ms. With
//! targets that change at random the face comes at most 5 mm in front of two walls. With a box on the wall that holds in 99 of 100
//! steps, and it comes up to 0.1 m in front of the wall in the others, because a goal may change while the board is in the box
//! (bounds of tests/it/approach.rs).
//!
//! Without `BoardTarget::near` a goal is chosen near the last one, not far from limits and singular poses. Where a drifting target
//! runs into a limit (a vertical wall at shoulder height makes shoulder and wrist singular together), the board goes to another roll
//! or arm posture, with up to radians of joint travel.
//!
//! A slide looks no further ahead than where it can stop. In 3 of 88 touches at 80 mm/s that also turned by 20 degrees, the board
//! was off its speed for some 50 ms and up to 1.4 mm off its plane, probably because a joint met its limit or a singular pose some
//! centimetres ahead (not traced).

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
pub use profile::{JointBounds, JointMotion};
pub use slide::Slide;
