//! Sizes of the regions that hold a contact with a stated probability, learned from prediction errors.

mod alike;
#[cfg(feature = "serde")]
mod file;
mod in_plane;
mod model;
mod quantiles;
mod sizes;
mod training;

pub(super) use in_plane::InPlaneError;
pub use model::RegionModel;
pub use sizes::{REGION_SHARES, RegionSizes};
