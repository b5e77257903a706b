//! Rigid parts: triangles, their hierarchy, and how queries search it.

mod block;
mod even_tree;
mod machine;
mod merging;
mod rigid_part;
mod sliver;
mod together;
mod tree;
pub(crate) mod triangle;

pub(crate) use rigid_part::{Face, Part, PartHit, PartRay};
pub use tree::BuildQuality;
pub(crate) use tree::{ALL, MAX_TRIANGLES};
