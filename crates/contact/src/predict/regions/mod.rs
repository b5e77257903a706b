//! How large the regions are that hold a contact with a stated probability, learnt from how far predictions were off.

mod model;
mod quantiles;
mod sizes;
mod training;

pub use model::RegionModel;
pub use sizes::{REGION_SHARES, RegionSizes};
