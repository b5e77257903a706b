//! Base positions and their scores.

use super::config::PlacementConfig;
use hwall_kinematics::Pose;

/// One base pose and its scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The base frame in the room.
    pub room_from_base: Pose,
    /// Configured heading: rotation of the base about the vertical, rad.
    pub heading_rad: f64,
    /// Targets reached.
    pub reachable: usize,
    /// Total number of targets.
    pub total: usize,
    /// Smallest margin ([`position_margin_m`](crate::line::position_margin_m), at the roll with the largest)
    /// of the targets reached, m: zero if one of them has no proven margin, `None` if no target is reached.
    pub worst_margin_m: Option<f64>,
    /// Mean margin of the targets reached, m.
    pub mean_margin_m: Option<f64>,
}

impl Placement {
    /// Fraction of the targets reached, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.reachable as f64 / self.total as f64
    }
}

/// The best heading of a position, for a heat map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacementCell {
    /// The first heading that reaches the most targets, rad.
    pub heading_rad: f64,
    /// Targets reached with it.
    pub reachable: usize,
}

/// Scores of all candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacementScores {
    pub(super) config: PlacementConfig,
    pub(super) total: usize,
    /// Row by row (y), position by position (x), heading by heading.
    pub(super) counts: Vec<u32>,
    pub(super) best: Vec<Placement>,
}

impl PlacementScores {
    /// The best positions, each at its best heading: by targets reached, then by the worst
    /// margin, then in the order of the grid (x fastest).
    #[must_use]
    pub fn best(&self) -> &[Placement] {
        &self.best
    }

    /// The settings of the search.
    #[must_use]
    pub const fn config(&self) -> &PlacementConfig {
        &self.config
    }

    /// Total number of targets.
    #[must_use]
    pub const fn total(&self) -> usize {
        self.total
    }

    /// Targets reached from position `(ix, iy)` at a heading's index; `None` outside the grid.
    #[must_use]
    pub fn reachable(&self, ix: usize, iy: usize, heading: usize) -> Option<usize> {
        self.of_position(ix, iy)?.get(heading).map(|&n| n as usize)
    }

    /// The best heading of position `(ix, iy)`; `None` outside the grid.
    #[must_use]
    pub fn cell(&self, ix: usize, iy: usize) -> Option<PlacementCell> {
        let counts = self.of_position(ix, iy)?;
        let reachable = most(counts);
        let heading = counts.iter().position(|&n| n == reachable)?;
        Some(PlacementCell {
            heading_rad: self.config.headings_rad[heading],
            reachable: reachable as usize,
        })
    }

    /// The heat map: the largest fraction of targets, 0 to 1, at each position, row by row (x fastest).
    #[must_use]
    pub fn shares(&self) -> Vec<f64> {
        let positions = self.counts.chunks_exact(self.config.headings_rad.len());
        let share = |counts| f64::from(most(counts)) / self.total as f64;
        positions.map(share).collect()
    }

    fn of_position(&self, ix: usize, iy: usize) -> Option<&[u32]> {
        let (columns, rows) = (self.config.x.count(), self.config.y.count());
        if ix >= columns || iy >= rows {
            return None;
        }
        let headings = self.config.headings_rad.len();
        Some(&self.counts[(iy * columns + ix) * headings..][..headings])
    }
}

/// The largest of a position's counts.
pub(super) fn most(counts: &[u32]) -> u32 {
    counts.iter().copied().max().unwrap_or(0)
}
