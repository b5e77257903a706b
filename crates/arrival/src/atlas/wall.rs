//! The nodes of one wall.

use glam::DVec3;
use hwall_kinematics::JointPositions;
use hwall_reachability::{Steps, WallPlane, WallPoint};
use serde::{Deserialize, Serialize};

/// The configuration chosen for one place of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtlasNode {
    /// Joint positions that hold the middle of the board at the place, rad.
    pub q: JointPositions,
    /// Roll of the board about its normal, rad.
    pub roll_rad: f64,
    /// Least time from the waiting posture, s.
    pub arrival_s: f64,
    /// Does the straight joint path from the waiting posture keep the clearances?
    pub clear: bool,
    /// Largest clearance violation along that path, m: beyond the tolerance for the board in front of surfaces, or into the clearances of elbow,
    /// wrist and the arm's own body. 0 if the path is clear.
    pub excess_m: f64,
    /// How far the board held here is in front of a surface, m: near an outer corner of a room it overhangs. 0 if it does not.
    pub overhang_m: f64,
}

/// A node and its place in the grid of its wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodePlace {
    /// Index along the wall.
    pub column: usize,
    /// Index upwards.
    pub row: usize,
}

/// The nodes of one wall: a grid over its reachable part.
#[derive(Debug, Clone, PartialEq)]
pub struct AtlasWall {
    pub(super) plane: WallPlane,
    pub(super) along: Steps,
    pub(super) heights: Steps,
    /// Row by row.
    pub(super) nodes: Vec<Option<AtlasNode>>,
    pub(super) seam_rad: f64,
}

/// A node as stored in a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredNode {
    pub(super) q: [f64; 7],
    pub(super) roll: u8,
    pub(super) excess_m: f64,
    pub(super) overhang_m: f64,
}

impl AtlasWall {
    /// The wall's plane, normal towards the person.
    #[must_use]
    pub const fn plane(&self) -> &WallPlane {
        &self.plane
    }

    /// Coordinates of the columns along the wall, m.
    #[must_use]
    pub const fn along(&self) -> &Steps {
        &self.along
    }

    /// Heights of the rows, m.
    #[must_use]
    pub const fn heights(&self) -> &Steps {
        &self.heights
    }

    /// A node; `None` if the arm cannot present the board there (a hole), and outside the grid.
    #[must_use]
    pub fn node(&self, place: NodePlace) -> Option<&AtlasNode> {
        if place.column >= self.along.count() || place.row >= self.heights.count() {
            return None;
        }
        let index = place.row * self.along.count() + place.column;
        self.nodes.get(index)?.as_ref()
    }

    /// Position of a node in the base frame, m.
    #[must_use]
    pub fn point_m(&self, place: NodePlace) -> DVec3 {
        let at = WallPoint::new(self.along.at(place.column), self.heights.at(place.row));
        self.plane.point_m(at)
    }

    /// All places of the grid, row by row.
    pub fn places(&self) -> impl Iterator<Item = NodePlace> + use<> {
        let columns = self.along.count();
        (0..self.heights.count())
            .flat_map(move |row| (0..columns).map(move |column| NodePlace { column, row }))
    }

    /// Pairs of neighbours with a seam between them.
    pub fn seams(&self) -> impl Iterator<Item = [NodePlace; 2]> + '_ {
        self.places().flat_map(move |a| {
            let NodePlace { column, row } = a;
            let right = NodePlace {
                column: column + 1,
                row,
            };
            let above = NodePlace {
                column,
                row: row + 1,
            };
            [right, above]
                .into_iter()
                .filter(move |b| match (self.node(a), self.node(*b)) {
                    (Some(a), Some(b)) => a.q.max_abs_difference(&b.q) > self.seam_rad,
                    _ => false,
                })
                .map(move |b| [a, b])
        })
    }
}
