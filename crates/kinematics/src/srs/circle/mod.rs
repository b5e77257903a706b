//! The elbow's circle: the geometry behind every answer of the closed form.

mod distances;
mod elbow_circle;
mod glance;
mod limit_roots;
mod pinched;
mod sinusoid;
mod solution;
mod triangle;
mod window;

pub(super) use distances::Distances;
pub(super) use elbow_circle::{ElbowCircle, Slack, reference_frame};
pub(super) use pinched::Pinched;
pub(super) use sinusoid::Direction;
pub(super) use solution::BaseSolution;
pub(super) use triangle::Triangle;
pub(super) use window::{CROSS_TOLERANCE, Windows};
