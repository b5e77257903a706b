//! The face of the board: the rectangle that must stay behind surfaces.

use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::positive;
use serde::{Deserialize, Serialize};

/// Size of the board's face. The tool point is its middle; its sides are along the tool's x and y axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoardExtent {
    /// Half of the extent along the tool's x axis, m; default 0.1.
    pub half_width_m: f64,
    /// Half of the extent along the tool's y axis, m; default 0.1.
    pub half_height_m: f64,
}

impl Default for BoardExtent {
    /// 200 x 200 mm, as in the dissertation.
    fn default() -> Self {
        Self {
            half_width_m: 0.1,
            half_height_m: 0.1,
        }
    }
}

impl BoardExtent {
    /// Rejects extents that are not positive.
    ///
    /// # Errors
    /// The first extent that is not positive and finite.
    pub fn validate(&self) -> Result<(), ArgumentError> {
        positive("half_width_m", self.half_width_m)?;
        positive("half_height_m", self.half_height_m)?;
        Ok(())
    }

    /// The corners and the middle of the face in the base frame, m.
    #[must_use]
    pub fn points_m(&self, base_from_tool: &Pose) -> [DVec3; 5] {
        let rotation = base_from_tool.rotation();
        let middle = base_from_tool.position_m();
        let x = rotation.x_axis * self.half_width_m;
        let y = rotation.y_axis * self.half_height_m;
        [
            middle + x + y,
            middle - x + y,
            middle - x - y,
            middle + x - y,
            middle,
        ]
    }
}
