//! Look-ups: from a place and a normal to a configuration.

use super::build::Atlas;
use super::wall::{AtlasNode, AtlasWall, NodePlace};
use glam::DVec3;
use hwall_kinematics::{JointPositions, MOST_JOINTS};
use hwall_reachability::{Steps, WallPoint};
use std::f64::consts::TAU;

/// Number of directions that a look-up with slack tries.
const DIRECTIONS: u32 = 8;

/// How the arm should present a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtlasEntry {
    /// Joint positions that hold the board at `point_m`, rad: to 1e-9 m at a node, to millimetres if interpolated between nodes. Refine them
    /// by a local inverse kinematics.
    pub q: JointPositions,
    /// Middle of the board, base frame, m: the requested place on the wall, or the nearest node if neighbours do not agree, or another place within
    /// the slack.
    pub point_m: DVec3,
    /// Normal of the wall towards the person.
    pub normal: DVec3,
    /// Roll of the board about its normal, rad.
    pub roll_rad: f64,
    /// Least time from the waiting posture to `q`, s.
    pub arrival_s: f64,
    /// Do all nodes used have a clear path from the waiting posture?
    pub clear: bool,
    /// Interpolated between neighbours that agree? If not, it is the nearest node, next to a seam or a hole.
    pub smooth: bool,
    /// How far the board held here is in front of a surface, m: the maximum over the nodes used.
    pub overhang_m: f64,
    /// Index of the wall in [`Atlas::walls`].
    pub wall: usize,
}

impl Atlas {
    /// The configuration for presenting a place of a wall. `point_m` (base frame) may be a little off the wall; `normal` points towards the person,
    /// with any length, and may be a little off too, as configured.
    ///
    /// Interpolates between the four nodes around the place if they agree, else returns the nearest node. `None` if there is no wall or the place
    /// is a hole: no node around it is within reach. Also for NaN. It takes less than a microsecond and does not allocate.
    #[must_use]
    pub fn look_up(&self, point_m: DVec3, normal: DVec3) -> Option<AtlasEntry> {
        self.look_up_within(point_m, normal, 0.0)
    }

    /// As [`look_up`](Self::look_up), with the middle of the board anywhere within `slack_m` of the place along the wall: the entry that arrives
    /// first. Holes narrower than the slack are bridged.
    ///
    /// A clear path has priority over an early arrival. A negative or NaN slack counts as zero.
    #[must_use]
    pub fn look_up_within(
        &self,
        point_m: DVec3,
        normal: DVec3,
        slack_m: f64,
    ) -> Option<AtlasEntry> {
        // NaN becomes zero, too.
        let slack_m = slack_m.max(0.0);
        let (wall, at) = self.find_within(point_m, normal, slack_m)?;
        let here = self.entry(wall, at);
        if slack_m == 0.0 {
            return here;
        }
        // Slightly less, so that rounding does not exceed the slack.
        let radius_m = slack_m * (1.0 - 1e-9);
        let around = (0..2 * DIRECTIONS).filter_map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(DIRECTIONS)).sin_cos();
            let radius_m = if i < DIRECTIONS {
                radius_m
            } else {
                0.5 * radius_m
            };
            let entry = self.entry(
                wall,
                WallPoint::new(at.s_m + radius_m * cos, at.z_m + radius_m * sin),
            )?;
            let projection = self.walls[wall].plane.project(entry.point_m);
            (projection.at.distance_m(at) <= slack_m).then_some(entry)
        });
        here.into_iter().chain(around).min_by(|a, b| {
            let blocked = a.clear.cmp(&b.clear).reverse();
            blocked.then(a.arrival_s.total_cmp(&b.arrival_s))
        })
    }

    /// The nearest wall with a similar normal, and the place on it.
    fn find_within(
        &self,
        point_m: DVec3,
        normal: DVec3,
        slack_m: f64,
    ) -> Option<(usize, WallPoint)> {
        let length = normal.length();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let mut best: Option<(f64, usize, WallPoint)> = None;
        for (index, wall) in self.walls.iter().enumerate() {
            let cosine = wall.plane.normal().dot(normal) / length;
            let projection = wall.plane.project(point_m);
            let off_m = projection.off_m.abs();
            let near = cosine >= self.least_cosine
                && off_m <= self.off_m
                && wall.holds(projection.at, slack_m)
                && best.is_none_or(|(least, ..)| off_m < least);
            if near {
                best = Some((off_m, index, projection.at));
            }
        }
        best.map(|(_, wall, at)| (wall, at))
    }

    /// The entry of a place on a wall.
    fn entry(&self, wall_index: usize, at: WallPoint) -> Option<AtlasEntry> {
        let wall = &self.walls[wall_index];
        if !wall.holds(at, 0.0) {
            return None;
        }
        let (columns, s) = around(&wall.along, at.s_m);
        let (rows, z) = around(&wall.heights, at.z_m);
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| NodePlace {
            column: columns[i],
            row: rows[j],
        });
        let nodes = corners.map(|place| wall.node(place));
        let entry = |node: AtlasNode, point_m, smooth| AtlasEntry {
            q: node.q,
            point_m,
            normal: wall.plane.normal(),
            roll_rad: node.roll_rad,
            arrival_s: self.limits.travel_time_s(&self.waiting, &node.q),
            clear: node.clear,
            smooth,
            overhang_m: node.overhang_m,
            wall: wall_index,
        };
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&z);
        if let ([Some(a), Some(b), Some(c), Some(d)], true) = (nodes, inside) {
            let all = [a, b, c, d];
            let apart_rad = |x: &AtlasNode, y: &AtlasNode| x.q.max_abs_difference(&y.q);
            let sides = [(a, b), (a, c), (b, d), (c, d)];
            let agree = sides.iter().all(|(x, y)| apart_rad(x, y) <= self.seam_rad)
                && apart_rad(a, d) <= 1.5 * self.seam_rad
                && all.iter().all(|n| n.roll_rad == a.roll_rad);
            if agree {
                let weights = [(1.0 - s) * (1.0 - z), s * (1.0 - z), (1.0 - s) * z, s * z];
                let node = AtlasNode {
                    q: mixed(all, weights),
                    clear: all.iter().all(|n| n.clear),
                    overhang_m: all.iter().fold(0.0, |m: f64, n| m.max(n.overhang_m)),
                    ..*a
                };
                return Some(entry(node, wall.plane.point_m(at), true));
            }
        }
        let distance_m = |place: NodePlace| {
            let (ds, dz) = (
                wall.along.at(place.column) - at.s_m,
                wall.heights.at(place.row) - at.z_m,
            );
            ds.hypot(dz)
        };
        let present = corners.into_iter().zip(nodes);
        let (place, node) = present
            .filter_map(|(place, node)| Some((place, node?)))
            .min_by(|a, b| distance_m(a.0).total_cmp(&distance_m(b.0)))?;
        Some(entry(*node, wall.point_m(place), false))
    }
}

impl AtlasWall {
    /// Is the place on the grid, or within half a spacing plus `slack_m` of it?
    fn holds(&self, at: WallPoint, slack_m: f64) -> bool {
        let within = |steps: &Steps, value: f64| {
            let beyond = 0.5 * steps.spacing_m() + slack_m;
            let (first, last) = (steps.at(0), steps.at(steps.count() - 1));
            first.min(last) - beyond <= value && value <= first.max(last) + beyond
        };
        within(&self.along, at.s_m) && within(&self.heights, at.z_m)
    }
}

/// The indices before and after a value, and the interpolation parameter, outside 0 to 1 beyond the ends. With a single step only its exact value
/// counts as inside.
fn around(steps: &Steps, value: f64) -> ([usize; 2], f64) {
    let last = steps.count() - 1;
    if last == 0 {
        return ([0, 0], if value == steps.at(0) { 0.0 } else { -1.0 });
    }
    let steps_in = (value - steps.at(0)) / (steps.at(1) - steps.at(0));
    let first = (steps_in.max(0.0) as usize).min(last - 1);
    ([first, first + 1], steps_in - first as f64)
}

fn mixed(nodes: [&AtlasNode; 4], weights: [f64; 4]) -> JointPositions {
    let mut q = JointPositions::default();
    for joint in 0..MOST_JOINTS {
        q[joint] = nodes.iter().zip(weights).map(|(n, w)| w * n.q[joint]).sum();
    }
    q
}
