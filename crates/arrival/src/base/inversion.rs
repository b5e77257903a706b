//! For each place on a room's walls the base poses that serve it.

use super::drive::BasePose;
use crate::error::ArrivalError;
use glam::{DVec2, DVec3};
use hwall_kinematics::SrsArm;
use hwall_numeric::check::{non_negative, positive};
use hwall_numeric::parallel;
use hwall_reachability::{
    ExactConfig, Interval, LineIndex, ReachabilityMap, Roll, Steps, WallFacet, WallGrid, WallPlane,
};

/// Which base poses and which places on the walls.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseInversionConfig {
    /// Distances of the base behind a wall that it faces, m; default 0.54 to 0.74 in steps of 0.04.
    pub behind: Steps,
    /// Distance between base poses along a wall, m; default 0.15.
    pub along_m: f64,
    /// Largest width of the columns of cells of a wall, m; default 0.1. All columns of a wall have the same width.
    pub cell_m: f64,
    /// Heights of the cells above the base, m; default -0.2 to 1 in steps of 0.1.
    pub heights: Steps,
    /// Cells stay this far inside the ends of what is reachable, m; default 0.02.
    pub inset_m: f64,
}

impl Default for BaseInversionConfig {
    fn default() -> Self {
        let steps = |first, step, count| Steps::new(first, step, count).expect("constants");
        Self {
            behind: steps(0.54, 0.04, 6),
            along_m: 0.15,
            cell_m: 0.1,
            heights: steps(-0.2, 0.1, 13),
            inset_m: 0.02,
        }
    }
}

/// Planes of the map, m: all distances at which a base may see a wall. Their step divides that of `behind` and usual depths of shelves.
const PLANES_M: [f64; 2] = [0.3, 0.8];
const PLANE_STEP_M: f64 = 0.02;
/// Half of the angle around the heading in which a base serves walls, as a cosine: 150 degrees, inside the range of joint 1.
const AHEAD_COSINE: f64 = -0.866;

/// A wall of a room, cut into cells.
#[derive(Debug, Clone)]
struct Wall {
    plane: WallPlane,
    /// Along the wall, m.
    span_m: Interval,
    heights: Interval,
    columns: usize,
    /// Width of a column, m: at most the side of a cell.
    column_m: f64,
    /// The first of its cells, column by column.
    first: usize,
}

impl Wall {
    /// The middle of a column, at height zero, m.
    fn foot_m(&self, column: usize) -> DVec3 {
        let s_m = self.span_m.lo_m + (column as f64 + 0.5) * self.column_m;
        self.plane.normal() * self.plane.distance_m() + self.plane.along() * s_m
    }
}

/// The base poses that serve each cell of a room's walls.
///
/// Whether an arm can hold a board depends on the pose of the board relative to the base alone, so one map of parallel planes answers for every base
/// pose: that of the nearest of planes 2 cm apart, at the height of the cell. Base poses face a wall, at given distances behind it. Poses are in the
/// frame of the room, whose origin is at the height of the base.
#[derive(Debug, Clone)]
pub struct BaseInversion {
    config: BaseInversionConfig,
    walls: Vec<Wall>,
    bases: Vec<BasePose>,
    /// Cell by cell, the indices of the bases in rising order.
    serving: Vec<Vec<u32>>,
}

impl BaseInversion {
    /// The map for all rooms: the planes at which a base may see a wall.
    ///
    /// # Errors
    /// As for [`ReachabilityMap::build`].
    pub fn map(
        arm: &SrsArm,
        config: &BaseInversionConfig,
    ) -> Result<ReachabilityMap, ArrivalError> {
        let exact = ExactConfig {
            roll: Roll::quarter_turns(),
            ..ExactConfig::default()
        };
        let grid = WallGrid {
            heading_rad: 0.0,
            distances: Steps::spanning(PLANES_M[0], PLANES_M[1], PLANE_STEP_M)?,
            heights: config.heights,
            span_m: None,
        };
        Ok(ReachabilityMap::build(arm, &exact, vec![grid])?)
    }

    /// Inverts a [`map`](Self::map) made with the same configuration for the walls of a room. `normal` of each facet points to the person's side.
    ///
    /// # Errors
    /// A facet that is not finite or not vertical, a setting outside its range.
    pub fn of_room(
        map: &ReachabilityMap,
        facets: &[WallFacet],
        config: BaseInversionConfig,
    ) -> Result<Self, ArrivalError> {
        positive("along_m", config.along_m)?;
        positive("cell_m", config.cell_m)?;
        non_negative("inset_m", config.inset_m)?;
        let (mut walls, mut bases, mut cells) = (Vec::new(), Vec::new(), 0);
        for facet in facets {
            let plane = WallPlane::through(facet.point_m, facet.normal)?;
            let along = facet
                .outline_m
                .iter()
                .map(|corner| plane.along().dot(*corner));
            let (lo, hi) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), s| {
                (lo.min(s), hi.max(s))
            });
            let width_m = positive("width of a wall", hi - lo)?;
            let columns = (width_m / config.cell_m).ceil() as usize;
            walls.push(Wall {
                plane,
                span_m: Interval::new(lo, hi),
                heights: facet.heights,
                columns,
                column_m: width_m / columns as f64,
                first: cells,
            });
            cells += columns * config.heights.count();
            let poses = (width_m / config.along_m).floor() as usize;
            for column in 0..=poses {
                let s_m = 0.5 * (lo + hi) + config.along_m * (column as f64 - 0.5 * poses as f64);
                for behind_m in (0..config.behind.count()).map(|i| config.behind.at(i)) {
                    let on_wall = plane.normal() * plane.distance_m() + plane.along() * s_m;
                    bases.push(BasePose {
                        at_m: (on_wall - plane.normal() * behind_m).truncate(),
                        yaw_rad: plane.heading_rad(),
                    });
                }
            }
        }
        let mut inversion = Self {
            config,
            walls,
            bases,
            serving: Vec::new(),
        };
        let columns = inversion.walls.iter().enumerate();
        let columns: Vec<(usize, usize)> = columns
            .flat_map(|(wall, of)| (0..of.columns).map(move |column| (wall, column)))
            .collect();
        let serving = parallel::map(columns.len(), |i| inversion.of_column(map, columns[i]));
        inversion.serving = serving.into_iter().flatten().collect();
        Ok(inversion)
    }

    /// The bases that serve each cell of a column, from below.
    fn of_column(&self, map: &ReachabilityMap, (wall, column): (usize, usize)) -> Vec<Vec<u32>> {
        let of = &self.walls[wall];
        let foot_m = of.foot_m(column);
        let mut found = vec![Vec::new(); self.config.heights.count()];
        for (index, base) in self.bases.iter().enumerate() {
            let Some((distance_m, aside_m)) = relative(base, foot_m.truncate(), &of.plane) else {
                continue;
            };
            let plane = ((distance_m - PLANES_M[0]) / PLANE_STEP_M).round();
            for (height, bases) in found.iter_mut().enumerate() {
                if !of.heights.contains(self.config.heights.at(height)) {
                    continue;
                }
                let line = LineIndex {
                    wall: 0,
                    plane: plane as usize,
                    height,
                };
                let serves = map.intervals(line).iter().any(|reachable| {
                    let Interval { lo_m, hi_m } = reachable.span;
                    lo_m + self.config.inset_m <= aside_m && aside_m <= hi_m - self.config.inset_m
                });
                if serves {
                    bases.push(index as u32);
                }
            }
        }
        found
    }

    /// All base poses.
    #[must_use]
    pub fn bases(&self) -> &[BasePose] {
        &self.bases
    }

    /// Number of cells.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.serving.len()
    }

    /// The base poses that serve a place, those of its cell; empty for a place on none of the walls.
    #[must_use]
    pub fn serving(&self, point_m: DVec3, normal: DVec3) -> &[u32] {
        let cell = self.cell(point_m, normal);
        cell.map_or(&[], |cell| &self.serving[cell])
    }

    /// The middle and the normal of a cell.
    #[must_use]
    pub fn middle(&self, cell: usize) -> Option<(DVec3, DVec3)> {
        let wall = self.walls.iter().rev().find(|wall| wall.first <= cell)?;
        let (column, height) = (
            (cell - wall.first) / self.config.heights.count(),
            (cell - wall.first) % self.config.heights.count(),
        );
        let middle_m = wall.foot_m(column).with_z(self.config.heights.at(height));
        (column < wall.columns).then_some((middle_m, wall.plane.normal()))
    }

    /// The cell of a place; `None` on none of the walls, and more than half a step above or below all heights.
    #[must_use]
    pub fn cell(&self, point_m: DVec3, normal: DVec3) -> Option<usize> {
        const ON_WALL_M: f64 = 0.02;
        const SAME_COSINE: f64 = 0.99;
        let wall = self.walls.iter().find(|wall| {
            let off_m = wall.plane.project(point_m).off_m;
            let s_m = wall.plane.along().dot(point_m);
            off_m.abs() <= ON_WALL_M
                && wall.plane.normal().dot(normal) >= SAME_COSINE
                && wall.span_m.contains(s_m)
                && wall.heights.contains(point_m.z)
        })?;
        let s_m = wall.plane.along().dot(point_m) - wall.span_m.lo_m;
        let column = ((s_m / wall.column_m) as usize).min(wall.columns - 1);
        let height = self.config.heights.nearest(point_m.z)?;
        Some(wall.first + column * self.config.heights.count() + height)
    }
}

/// Distance of a wall in front of a base, and of a place on it aside of the base, m; `None` if the map has no such plane.
fn relative(base: &BasePose, foot_m: DVec2, plane: &WallPlane) -> Option<(f64, f64)> {
    let (normal, along) = (plane.normal().truncate(), plane.along().truncate());
    let from_base_m = foot_m - base.at_m;
    let distance_m = normal.dot(from_base_m);
    let half_m = 0.5 * PLANE_STEP_M;
    let ahead = DVec2::from_angle(base.yaw_rad).dot(normal) >= AHEAD_COSINE;
    let mapped = (PLANES_M[0] - half_m..PLANES_M[1] + half_m).contains(&distance_m);
    (ahead && mapped).then(|| (distance_m, along.dot(from_base_m)))
}
