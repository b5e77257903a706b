//! The lines of a plane at any inclination.

use crate::error::Result;
use crate::line::{ExactConfig, ExactSolver, LineReachability};
use crate::plane::{Plane, PlaneLine};
use crate::steps::Steps;
use crate::wall::WallPoint;
use glam::DVec3;
use hwall_kinematics::SrsArm;

/// The reachable part of a table top, a ramp or an inclined wall: lines along the plane, each exact and proven.
///
/// Unlike in maps of vertical walls there is no symmetry between lines, so each line is solved separately.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{ExactConfig, Plane, PlaneMap, Steps};
///
/// // A table top 0.3 m above the base, from 0.3 to 0.9 m before it.
/// let table = Plane::through(DVec3::new(0.0, 0.0, 0.3), DVec3::Z)?;
/// let map = PlaneMap::build(
///     &SrsArm::iiwa7(),
///     &ExactConfig::default(),
///     table,
///     Steps::spanning(-0.9, -0.3, 0.05)?,
/// )?;
/// assert_eq!(map.look_up(DVec3::new(0.5, 0.2, 0.3)), Some(true)); // from below
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMap {
    plane: Plane,
    heights: Steps,
    lines: Vec<LineReachability>,
}

impl PlaneMap {
    /// Solves the lines at these distances up the plane.
    ///
    /// # Errors
    /// As [`ExactSolver::new`] and [`ExactSolver::plane_line`].
    pub fn build(arm: &SrsArm, config: &ExactConfig, plane: Plane, heights: Steps) -> Result<Self> {
        let solver = ExactSolver::new(arm, config)?;
        let lines = heights
            .iter()
            .map(|height| solver.plane_line(&plane.line(height)))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            plane,
            heights,
            lines,
        })
    }

    /// The plane.
    #[must_use]
    pub const fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Every line with its reachable part.
    pub fn lines(&self) -> impl Iterator<Item = (PlaneLine, &LineReachability)> {
        let lines = self.heights.iter().map(|height| self.plane.line(height));
        lines.zip(&self.lines)
    }

    /// Whether a board can be held at the projection of this point on the plane, according to the nearest line. `None` more
    /// than half a step beyond the lines, or for NaN.
    #[must_use]
    pub fn look_up(&self, point_m: DVec3) -> Option<bool> {
        let WallPoint { s_m, z_m } = self.plane.project(point_m).at;
        let line = self.lines.get(self.heights.nearest(z_m)?)?;
        Some(!s_m.is_nan() && line.contains(s_m))
    }

    /// Reachable area between the first line and the last, m²: the lines' lengths by the trapezoidal rule, so the border
    /// lines count half and a single line gives 0. Error: second order in the step at an inclined edge.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let lengths = self.lines.iter().map(LineReachability::length_m);
        self.heights.integral(lengths)
    }
}
