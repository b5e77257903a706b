//! Reachability maps of a scene's own walls, for the run time of the main job.

use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, LineIndex, ReachabilityMap, Roll, WallGrid, WallPoint};
use hwall_scene::Scene;
use std::time::{Duration, Instant};

/// Lines of a wall are this far apart, m.
const SPACING_M: f64 = 0.025;

/// A board that stands in for one out of reach stays this far inside the reachable part, m.
const INSET_M: f64 = 0.005;

/// The maps of all walls that the arm could reach at all.
pub struct WallMaps {
    map: Option<ReachabilityMap>,
    /// How long they took.
    pub took: Duration,
}

/// Where the board can be for a predicted contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presented {
    /// There.
    Reachable,
    /// Not there; the nearest place of the same wall, m.
    Nearest(DVec3),
    /// Nowhere on that wall, or on a surface that is no wall of the maps: the renderer decides.
    Unknown,
}

impl WallMaps {
    /// Maps of the scene's vertical surfaces: only their planes, only their heights, and only
    /// those within the arm's length. Any quarter turn of the board will do.
    ///
    /// # Errors
    /// None in practice: patches are finite and vertical.
    pub fn of_scene(arm: &SrsArm, scene: &Scene) -> anyhow::Result<Self> {
        let start = Instant::now();
        let g = arm.geometry();
        let reach_m = g.d_se_m + g.d_ew_m + g.d_wf_m + arm.flange_from_tool().position_m().length();
        let mut walls = Vec::new();
        for patch in scene.vertical_facets() {
            let (low, high) = (patch.lowest_m, patch.highest_m);
            let low = low.max(g.d_bs_m - reach_m);
            let high = high.min(g.d_bs_m + reach_m);
            let distance = patch.normal.dot(patch.point_m).abs();
            if low >= high || distance > reach_m {
                continue;
            }
            // Scenes do not say from which side a wall is touched.
            for normal in [patch.normal, -patch.normal] {
                let wall = WallGrid::for_wall(patch.point_m, normal, (low, high), SPACING_M)?
                    .within(patch.outline_m.iter().copied())?;
                if !walls.contains(&wall) {
                    walls.push(wall);
                }
            }
        }
        let config = ExactConfig {
            roll: Roll::quarter_turns(),
            ..ExactConfig::default()
        };
        let map = if walls.is_empty() {
            None
        } else {
            Some(ReachabilityMap::build(arm, &config, walls)?)
        };
        Ok(Self {
            map,
            took: start.elapsed(),
        })
    }

    /// How many walls and lines.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        self.map
            .as_ref()
            .map_or((0, 0), |map| (map.walls().len(), map.report().lines))
    }

    /// Looks a predicted contact up.
    #[must_use]
    pub fn present(&self, point_m: DVec3, normal: DVec3) -> Presented {
        let Some((map, found)) = self
            .map
            .as_ref()
            .and_then(|map| Some((map, map.look_up(point_m, normal)?)))
        else {
            return Presented::Unknown;
        };
        // Beside the end of a line the line is not the point: ask for the point itself.
        if found.reachable || map.is_reachable(point_m, normal).unwrap_or(false) {
            return Presented::Reachable;
        }
        let LineIndex { wall, plane, .. } = found.line;
        let at = WallPoint::new(found.s_m, point_m.z);
        let nearest = map.nearest_on_lines(wall, plane, at, INSET_M);
        match (nearest, map.line(found.line)) {
            (Some(nearest), Some(line)) => Presented::Nearest(line.plane.point_m(nearest)),
            _ => Presented::Unknown,
        }
    }

    /// Reachable stretches of all lines, ends in the base frame, m; for drawing.
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
