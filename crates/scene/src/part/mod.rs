//! Rigid parts: triangles, their hierarchy, and how queries search it.

mod block;
pub(crate) mod closest;
mod even_tree;
mod machine;
mod merging;
mod node;
mod rigid_part;
mod sliver;
mod together;
mod tree;
pub(crate) mod triangle;
mod watertight;

pub(crate) use rigid_part::{Part, PartHit, PartRay};
pub use tree::BuildQuality;
pub(crate) use tree::{ALL, MAX_TRIANGLES};
pub(crate) use triangle::Face;
