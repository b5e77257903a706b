//! A room's walls, and the nearest place of each where the arm can hold the board.

use super::grid::WallGrid;
use super::reachability_map::{LineIndex, ReachabilityMap};
use crate::error::Result;
use crate::line::{ExactConfig, Interval, Roll};
use crate::wall::WallPoint;
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_numeric::check::{finite, non_negative};

/// A flat vertical part of a room's surface, base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct WallFacet {
    /// Any point of its plane, m.
    pub point_m: DVec3,
    /// Its normal, horizontal, of any length but zero and to either side.
    pub normal: DVec3,
    /// Heights from its lower to its upper border, m.
    pub heights: Interval,
    /// Its corners, m: only how far they lie along the wall counts.
    pub outline_m: Vec<DVec3>,
}

/// How walls are mapped.
#[derive(Debug, Clone, PartialEq)]
pub struct WallMapsConfig {
    /// Largest distance between the lines of a wall, m; default 0.025.
    pub spacing_m: f64,
    /// A place that stands in for one out of reach stays this far away from the ends of its
    /// reachable stretch, m; default 0.005.
    pub inset_m: f64,
    /// What each line is asked for; by default any quarter turn of the board.
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

/// Where the board can be presented for a place on a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presented {
    /// At the place itself.
    Reachable,
    /// Not there, but at this place of the same wall, the nearest on its lines; m.
    Nearest(DVec3),
    /// Nowhere on that wall, or the place is on none of the walls, or above or below all that the
    /// arm could reach of them.
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
/// The default holds no wall: every place is [`Presented::Unknown`], as for an arm without a closed form.
#[derive(Debug, Clone, Default)]
pub struct WallMaps {
    /// `None` where no wall is near enough.
    map: Option<ReachabilityMap>,
    facets: Vec<WallFacet>,
    inset_m: f64,
}

impl WallMaps {
    /// Maps of the facets that lie within the arm's length: only their planes, heights and widths,
    /// from both sides, because a facet does not say from which side it is touched.
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
            // Here, because clipping would hide NaN.
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

    /// The map of all walls, two for each facet; `None` where no facet is near enough.
    #[must_use]
    pub const fn map(&self) -> Option<&ReachabilityMap> {
        self.map.as_ref()
    }

    /// The facets that were near enough, as they were given.
    #[must_use]
    pub fn facets(&self) -> &[WallFacet] {
        &self.facets
    }

    /// Where the board can be for a place on a wall and the wall's normal towards the person.
    ///
    /// The answer comes from the nearest line first; where that line is out of reach at the place,
    /// the place itself is asked for.
    #[must_use]
    pub fn present(&self, point_m: DVec3, normal: DVec3) -> Presented {
        let looked_up = |map: &ReachabilityMap| map.look_up(point_m, normal);
        let Some((map, found)) = self.map.as_ref().and_then(|m| Some((m, looked_up(m)?))) else {
            return Presented::Unknown;
        };
        // An error is a normal that leans too much to be a wall's: the nearest line still stands in.
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

    /// Reachable stretches of all lines by their ends, base frame, m; for drawing.
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
