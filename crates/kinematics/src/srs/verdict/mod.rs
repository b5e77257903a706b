//! Can the arm hold a pose, or a whole region of poses, and by what margin?

mod margin;
mod pose_region;
mod region;
mod region_bounds;
mod search;

pub use pose_region::PoseRegion;
pub use region::{RegionVerdict, ShoulderWristRange};
pub use search::{Verdict, Witness};
