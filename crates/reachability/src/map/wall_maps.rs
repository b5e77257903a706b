//! A room's walls, and the nearest point on each where the arm can hold the board.

use super::grid::WallGrid;
use super::reachability_map::{LineIndex, ReachabilityMap};
use crate::error::Result;
use crate::line::{ExactConfig, Interval, Roll};
use crate::wall::WallPoint;
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_numeric::check::{finite, non_negative};

/// A flat vertical facet of a room, base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct WallFacet {
    /// Any point of its plane, m.
    pub point_m: DVec3,
    /// Normal of the plane: horizontal, of any length but zero, and to either side.
    pub normal: DVec3,
    /// Heights from its lower to its upper border, m.
    pub heights: Interval,
    /// Corners of the facet, m: only their extent along the wall is used.
    pub outline_m: Vec<DVec3>,
}

/// Settings of the wall maps.
#[derive(Debug, Clone, PartialEq)]
pub struct WallMapsConfig {
    /// Largest distance between the lines of a wall, m; default 0.025.
    pub spacing_m: f64,
    /// A substitute for an unreachable point stays this far inside the ends of its reachable stretch, m; default 0.005.
    pub inset_m: f64,
    /// Settings of the exact solver; by default any quarter turn of the board.
    pub exact: ExactConfig,
}

impl Default for WallMapsConfig {
    fn default() -> Self {
        Self {
            spacing_m: 0.025,
            inset_m: 0.005,
            exact: ExactConfig {
                roll: Roll::quarter_turns(),
                ..ExactConfig::default()
            },
        }
    }
}

/// Where the board can be presented for a point on a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presented {
    /// At the point itself.
    Reachable,
    /// Not there, but at this point of the same wall, the nearest on its lines; m.
    Nearest(DVec3),
    /// Nowhere on that wall; or the point is on none of the walls, or above or below all reachable points on them.
    Unknown,
}

/// Reachability of all walls of a room that are near enough to the arm.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{Interval, Presented, WallFacet, WallMaps, WallMapsConfig};
///
/// let wall = WallFacet {
///     point_m: DVec3::new(0.6, 0.0, 0.0),
///     normal: DVec3::X,
///     heights: Interval::new(0.0, 1.0),
///     outline_m: vec![DVec3::new(0.6, -2.0, 0.0), DVec3::new(0.6, 2.0, 1.0)],
/// };
/// let maps = WallMaps::build(&SrsArm::iiwa7(), &[wall], WallMapsConfig::default())?;
/// let near = maps.present(DVec3::new(0.6, 0.3, 0.5), DVec3::X);
/// assert_eq!(near, Presented::Reachable);
/// let far = maps.present(DVec3::new(0.6, 1.9, 0.5), DVec3::X);
/// assert!(matches!(far, Presented::Nearest(place) if place.x == 0.6 && place.y < 0.9));
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
///
/// The default has no walls: every point is [`Presented::Unknown`], as for an arm without a closed form.
#[derive(Debug, Clone, Default)]
pub struct WallMaps {
    /// `None` if no wall is near enough.
    map: Option<ReachabilityMap>,
    facets: Vec<WallFacet>,
    inset_m: f64,
}

impl WallMaps {
    /// Maps of the facets within the arm's length: only their planes, heights and widths, from both
    /// sides, because a facet does not define which side is touched.
    ///
    /// # Errors
    /// A facet that is not finite, not vertical or without an outline, a setting outside its range,
    /// or more lines than a map holds.
    pub fn build(arm: &SrsArm, facets: &[WallFacet], config: WallMapsConfig) -> Result<Self> {
        let g = arm.geometry();
        let longest_m =
            g.d_se_m + g.d_ew_m + g.d_wf_m + arm.flange_from_tool().position_m().length();
        non_negative("inset_m", config.inset_m)?;
        let mut walls = Vec::new();
        let mut near = Vec::new();
        for facet in facets {
            // Checked here, because clipping would hide NaN.
            finite("lower border", facet.heights.lo_m)?;
            finite("upper border", facet.heights.hi_m)?;
            let heights = Interval::new(
                facet.heights.lo_m.max(g.d_bs_m - longest_m),
                facet.heights.hi_m.min(g.d_bs_m + longest_m),
            );
            let distance = facet.normal.normalize_or_zero().dot(facet.point_m).abs();
            if heights.lo_m >= heights.hi_m || distance > longest_m {
                continue;
            }
            near.push(facet.clone());
            for normal in [facet.normal, -facet.normal] {
                let wall = WallGrid::for_wall(facet.point_m, normal, heights, config.spacing_m)?
                    .within(facet.outline_m.iter().copied())?;
                if !walls.contains(&wall) {
                    walls.push(wall);
                }
            }
        }
        let map = if walls.is_empty() {
            None
        } else {
            Some(ReachabilityMap::build(arm, &config.exact, walls)?)
        };
        Ok(Self {
            map,
            facets: near,
            inset_m: config.inset_m,
        })
    }

    /// The map of all walls, two per facet; `None` if no facet is near enough.
    #[must_use]
    pub const fn map(&self) -> Option<&ReachabilityMap> {
        self.map.as_ref()
    }

    /// The given facets that are near enough.
    #[must_use]
    pub fn facets(&self) -> &[WallFacet] {
        &self.facets
    }

    /// Where the board can be presented for a point on a wall, given the wall's normal towards the person.
    ///
    /// Checks the nearest line first; if it is not reachable there, checks the point itself.
    #[must_use]
    pub fn present(&self, point_m: DVec3, normal: DVec3) -> Presented {
        let looked_up = |map: &ReachabilityMap| map.look_up(point_m, normal);
        let Some((map, found)) = self.map.as_ref().and_then(|m| Some((m, looked_up(m)?))) else {
            return Presented::Unknown;
        };
        // An error means that the normal is too inclined for a wall: use the nearest line instead.
        if found.reachable || map.is_reachable(point_m, normal).unwrap_or(false) {
            return Presented::Reachable;
        }
        let LineIndex { wall, plane, .. } = found.line;
        let at = WallPoint::new(found.s_m, point_m.z);
        let nearest = map.nearest_on_lines(wall, plane, at, self.inset_m);
        match (nearest, map.line(found.line)) {
            (Some(nearest), Some(line)) => Presented::Nearest(line.plane.point_m(nearest)),
            _ => Presented::Unknown,
        }
    }

    /// Ends of the reachable stretches of all lines, base frame, m; for drawing.
    #[must_use]
    pub fn stretches(&self) -> Vec<[DVec3; 2]> {
        let Some(map) = &self.map else {
            return Vec::new();
        };
        let of_line = |index: LineIndex| {
            let line = map.line(index);
            let spans = map.intervals(index).iter();
            spans.filter_map(move |i| {
                let line = line?;
                Some([i.span.lo_m, i.span.hi_m].map(|s| line.point_m(s)))
            })
        };
        map.lines().flat_map(of_line).collect()
    }
}
