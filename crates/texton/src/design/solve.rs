//! Finds angles and speeds at which a texture has given magnitudes.

use super::candidate::LevelPath;
use super::response::{Felt, Grid, Response};

/// Where a magnitude was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) deg: f64,
    pub(super) speed_mm_per_s: f64,
    pub(super) felt: Felt,
}

/// The part of a grid in which levels may lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scope {
    /// Everywhere.
    All,
    /// At the angle of this row.
    Row(usize),
    /// At the speed of this column.
    Column(usize),
}

impl Scope {
    pub(super) const fn path(self) -> LevelPath {
        match self {
            Self::All => LevelPath::Both,
            Self::Row(_) => LevelPath::Speed,
            Self::Column(_) => LevelPath::Angle,
        }
    }

    const fn has(self, row: usize, column: usize) -> bool {
        match self {
            Self::All => true,
            Self::Row(only) => only == row,
            Self::Column(only) => only == column,
        }
    }
}

/// Halvings of a bracket: more than the bits of a double.
const HALVINGS: usize = 60;
/// Relative error of a magnitude that counts as found.
const FOUND: f64 = 1e-9;

impl Grid {
    /// Least and greatest magnitude in a scope; with `within`, only of magnitudes in the range of the model.
    pub(super) fn range(&self, scope: Scope, within: bool) -> Option<[f64; 2]> {
        let mut range: Option<[f64; 2]> = None;
        for (i, row) in self.felt.iter().enumerate() {
            for (j, felt) in row.iter().enumerate() {
                let Some(felt) = felt.filter(|f| !within || f.beyond.is_none()) else {
                    continue;
                };
                if scope.has(i, j) {
                    let [low, high] = range.unwrap_or([felt.magnitude; 2]);
                    range = Some([low.min(felt.magnitude), high.max(felt.magnitude)]);
                }
            }
        }
        range
    }

    /// The whole grid, the row and the column with the widest ratio of magnitudes, and the row and the column with the
    /// strongest magnitudes among those that reach the ratio `asked`.
    pub(super) fn scopes(&self, asked: f64) -> Vec<Scope> {
        let range = |scope: Scope| self.range(scope, true).or(self.range(scope, false));
        let ratio = |scope: Scope| range(scope).map_or(0.0, |[low, high]| high / low);
        let strength = |scope: Scope| range(scope).map_or(0.0, |[low, high]| low * high);
        let rows: Vec<Scope> = (0..self.angles_deg.len()).map(Scope::Row).collect();
        let columns: Vec<Scope> = (0..self.speeds_mm_per_s.len()).map(Scope::Column).collect();
        let mut scopes = vec![Scope::All];
        for lines in [rows, columns] {
            let lines = || lines.iter().copied();
            let widest = lines().max_by(|a, b| ratio(*a).total_cmp(&ratio(*b)));
            let strongest = lines()
                .filter(|line| ratio(*line) >= asked)
                .max_by(|a, b| strength(*a).total_cmp(&strength(*b)));
            scopes.extend(widest);
            scopes.extend(strongest.filter(|line| Some(*line) != widest));
        }
        scopes
    }

    /// The point in a scope with this magnitude, preferably within the model's range, then farthest from the ends of the device's
    /// range. If the magnitude jumps or has no prediction between two grid points, the next best pair is tried.
    pub(super) fn solve(
        &self,
        response: &Response<'_>,
        scope: Scope,
        magnitude: f64,
    ) -> Option<Found> {
        let (rows, columns) = (self.angles_deg.len(), self.speeds_mm_per_s.len());
        let mut brackets: Vec<Bracket> = Vec::new();
        let mut offer = |from: [usize; 2], to: [usize; 2], last: usize| {
            let (Some(a), Some(b)) = (self.felt[from[0]][from[1]], self.felt[to[0]][to[1]]) else {
                return;
            };
            if (a.magnitude - magnitude) * (b.magnitude - magnitude) > 0.0 {
                return;
            }
            let step = b.magnitude - a.magnitude;
            let share = if step == 0.0 {
                0.0
            } else {
                (magnitude - a.magnitude) / step
            };
            let along = if from[0] == to[0] { from[1] } else { from[0] };
            let at = (along as f64 + share) / last.max(1) as f64;
            let inside = a.beyond.is_none() && b.beyond.is_none();
            let depth = at.min(1.0 - at);
            brackets.push(Bracket {
                inside,
                depth,
                from,
                to,
            });
        };
        for i in 0..rows {
            for j in 0..columns {
                // Along the speed, then along the angle; a single point counts as a line.
                let alone = match scope {
                    Scope::Row(_) => columns == 1,
                    Scope::Column(_) => rows == 1,
                    Scope::All => rows == 1 && columns == 1,
                };
                if scope.has(i, j) && alone {
                    offer([i, j], [i, j], 0);
                }
                if j + 1 < columns && scope.has(i, j) && scope.has(i, j + 1) {
                    offer([i, j], [i, j + 1], columns - 1);
                }
                if i + 1 < rows && scope.has(i, j) && scope.has(i + 1, j) {
                    offer([i, j], [i + 1, j], rows - 1);
                }
            }
        }
        // Stable sort: ties are tried in grid order.
        brackets.sort_by(|a, b| (b.inside.cmp(&a.inside)).then(b.depth.total_cmp(&a.depth)));
        let place = |[i, j]: [usize; 2]| [self.angles_deg[i], self.speeds_mm_per_s[j]];
        brackets
            .iter()
            .find_map(|b| bisect(response, place(b.from), place(b.to), magnitude))
    }
}

/// Two neighbours of a grid on opposite sides of a magnitude.
struct Bracket {
    /// Are both within the model's measured range?
    inside: bool,
    /// Distance from the ends of the device's range, as a share of it.
    depth: f64,
    from: [usize; 2],
    to: [usize; 2],
}

/// The point with the magnitude, between two points that bracket it.
fn bisect(
    response: &Response<'_>,
    mut from: [f64; 2],
    mut to: [f64; 2],
    magnitude: f64,
) -> Option<Found> {
    let felt = |[deg, speed]: [f64; 2]| response.at(deg, speed);
    let off = |at: [f64; 2]| felt(at).map(|f| f.magnitude - magnitude);
    let mut low = off(from)?;
    for _ in 0..HALVINGS {
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        let at = off(middle)?;
        if (at > 0.0) == (low > 0.0) && low != 0.0 {
            (from, low) = (middle, at);
        } else {
            to = middle;
        }
    }
    // Take the better end: an exact solution may lie at the end of the device's range.
    let ends = [from, to]
        .into_iter()
        .filter_map(|at| Some((at, felt(at)?)));
    let miss = |felt: &Felt| (felt.magnitude / magnitude - 1.0).abs();
    let (at, felt) = ends.min_by(|a, b| miss(&a.1).total_cmp(&miss(&b.1)))?;
    (miss(&felt) <= FOUND).then_some(Found {
        deg: at[0],
        speed_mm_per_s: at[1],
        felt,
    })
}
