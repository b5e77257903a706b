#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod error;
mod pose;
mod six_vectors;

pub use error::GeometryError;
pub use glam;
pub use hwall_numeric::ArgumentError;
pub use pose::{Pose, PoseDistance, ROTATION_TOLERANCE, direction, rotation_vector};
pub use six_vectors::{Twist, Wrench};
