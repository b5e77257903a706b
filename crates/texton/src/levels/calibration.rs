//! Roughness that people reported for orientations and speeds, and its inverse.

use super::calibration_csv;
use super::level::Level;
use crate::error::{Result, TextonError};
use crate::geometry::ScanAngle;
use hwall_numeric::check::{finite, that};
use spade::{
    DelaunayTriangulation, HasPosition, LastUsedVertexHintGenerator, NaturalNeighbor, Point2,
    Triangulation,
};
use std::collections::HashSet;
use std::io::Read;

/// A condition of the study and its mean magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationNode {
    /// Angle between scan and long axis.
    pub scan: ScanAngle,
    /// Speed of the board, mm/s.
    pub speed_mm_per_s: f64,
    /// Mean magnitude, in the study's own scale.
    pub magnitude: f64,
    /// Number of rows averaged.
    pub rows: usize,
}

#[derive(Debug, Clone, Copy)]
struct Vertex {
    at: Point2<f64>,
    magnitude: f64,
}

impl HasPosition for Vertex {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Smallest orientation (degrees) and speed (mm/s) of the nodes, and their ranges.
#[derive(Debug, Clone, Copy)]
struct Scale {
    least: [f64; 2],
    range: [f64; 2],
}

impl Scale {
    /// The point of the mesh for an orientation and a speed.
    fn point(&self, scan: ScanAngle, speed_mm_per_s: f64) -> Point2<f64> {
        Point2::new(
            (scan.deg() - self.least[0]) / self.range[0],
            (speed_mm_per_s - self.least[1]) / self.range[1],
        )
    }
}

type Mesh = DelaunayTriangulation<Vertex, (), (), (), LastUsedVertexHintGenerator>;
type Neighbours<'a> = NaturalNeighbor<'a, Mesh>;

/// A table from orientation and speed to magnitude, interpolated between its nodes and inverted.
///
/// Orientation and speed are scaled by their ranges, then interpolated by natural neighbours (Sibson). The
/// interpolation is continuous, exact at the nodes and for magnitudes that are linear in both, linear along
/// the border, and never outside the range of the surrounding nodes. Undefined outside the convex hull of the
/// nodes.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Sorted by orientation, then speed.
    nodes: Vec<CalibrationNode>,
    mesh: Mesh,
    scale: Scale,
}

/// A point this close to a node or to the border counts as on it, in units of the ranges.
const ON: f64 = 1e-9;
/// Steps between two neighbouring nodes in the search for a crossing.
const PIECES: usize = 16;

/// For each point: is an earlier point so near that the mesh would merge the two?
fn too_near(points: impl Iterator<Item = Point2<f64>>) -> impl Iterator<Item = bool> {
    let mut taken = HashSet::new();
    points.map(move |point| {
        let cell = [point.x, point.y].map(|x| (x / ON).floor() as i64);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [cell[0] + i, cell[1] + j]));
        let near = around.into_iter().any(|cell| taken.contains(&cell));
        taken.insert(cell);
        near
    })
}

impl Calibration {
    /// From conditions and magnitudes in any order; magnitudes of the same condition are averaged.
    ///
    /// # Errors
    /// A speed outside 0 to 1e6 mm/s, a magnitude beyond 1e12, conditions that do not span an area, or that
    /// are almost but not exactly equal.
    pub fn from_rows(rows: impl IntoIterator<Item = Level>) -> Result<Self> {
        let mut table: Vec<Level> = rows.into_iter().collect();
        for row in &table {
            let (speed, magnitude) = (row.speed_mm_per_s, row.magnitude);
            let wanted = "at least 0 and at most 1e6";
            that(
                (0.0..=1e6).contains(&speed),
                "speed_mm_per_s",
                speed,
                wanted,
            )?;
            // Sums and differences of such values stay finite.
            that(
                magnitude.abs() <= 1e12,
                "magnitude",
                magnitude,
                "within 1e12 of zero",
            )?;
        }
        table.sort_by(|a, b| {
            let by_orientation = a.scan.rad().total_cmp(&b.scan.rad());
            by_orientation.then(a.speed_mm_per_s.total_cmp(&b.speed_mm_per_s))
        });
        let same = |a: &Level, b: &Level| a.scan == b.scan && a.speed_mm_per_s == b.speed_mm_per_s;
        let nodes = table.chunk_by(same).map(|rows| CalibrationNode {
            scan: rows[0].scan,
            speed_mm_per_s: rows[0].speed_mm_per_s,
            magnitude: rows.iter().map(|row| row.magnitude).sum::<f64>() / rows.len() as f64,
            rows: rows.len(),
        });
        Self::from_nodes(nodes.collect())
    }

    /// From a CSV with a header that names at least `orientation_deg`, `velocity_mm_s` and `value`, in any
    /// order; the rows may be in any order, and rows of one condition (participants, rounds) are averaged.
    ///
    /// # Errors
    /// A missing column; a line that cannot be read, with its number; as [`Calibration::from_rows`].
    pub fn from_csv(csv: impl Read) -> Result<Self> {
        Self::from_rows(calibration_csv::read(csv)?)
    }

    fn from_nodes(nodes: Vec<CalibrationNode>) -> Result<Self> {
        let flat = TextonError::NoArea { nodes: nodes.len() };
        let bounds = |of: fn(&CalibrationNode) -> f64| {
            let values = nodes.iter().map(of);
            let least = values.clone().fold(f64::INFINITY, f64::min);
            (least, values.fold(f64::NEG_INFINITY, f64::max) - least)
        };
        let (least_deg, range_deg) = bounds(|node| node.scan.deg());
        let (least_speed, range_speed) = bounds(|node| node.speed_mm_per_s);
        if !(range_deg > 0.0 && range_speed > 0.0) {
            return Err(flat);
        }
        let scale = Scale {
            least: [least_deg, least_speed],
            range: [range_deg, range_speed],
        };
        for (near, node) in
            too_near(nodes.iter().map(|n| scale.point(n.scan, n.speed_mm_per_s))).zip(&nodes)
        {
            let wanted =
                "further from those of other conditions than 1e-9 of the range, or the same";
            that(!near, "speed_mm_per_s", node.speed_mm_per_s, wanted)?;
        }
        let vertices = nodes.iter().map(|node| Vertex {
            at: scale.point(node.scan, node.speed_mm_per_s),
            magnitude: node.magnitude,
        });
        let mesh = Mesh::bulk_load_stable(vertices.collect()).map_err(|_| flat.clone())?;
        if mesh.num_inner_faces() == 0 {
            return Err(flat);
        }
        Ok(Self { nodes, mesh, scale })
    }

    /// The conditions, sorted by orientation, then speed.
    #[must_use]
    pub fn nodes(&self) -> &[CalibrationNode] {
        &self.nodes
    }

    /// The conditions as levels to choose from.
    #[must_use]
    pub fn levels(&self) -> Vec<Level> {
        let level = |node: &CalibrationNode| Level {
            scan: node.scan,
            speed_mm_per_s: node.speed_mm_per_s,
            magnitude: node.magnitude,
        };
        self.nodes.iter().map(level).collect()
    }

    /// The magnitude of an orientation and a speed.
    ///
    /// # Errors
    /// A speed that is not finite; a point outside the hull of the nodes.
    pub fn magnitude(&self, scan: ScanAngle, speed_mm_per_s: f64) -> Result<f64> {
        finite("speed_mm_per_s", speed_mm_per_s)?;
        self.interpolate(&self.mesh.natural_neighbor(), scan, speed_mm_per_s)
            .ok_or(TextonError::OutsideCalibration {
                orientation_deg: scan.deg(),
                speed_mm_per_s,
            })
    }

    /// The smallest speed with this magnitude at an orientation, mm/s.
    ///
    /// Error: 1e-12 of the range of speeds.
    ///
    /// # Errors
    /// No speed has this magnitude at this orientation (the error states the possible range); the orientation
    /// lies outside the hull at every speed (reported with the smallest speed).
    pub fn speed_for(&self, magnitude: f64, scan: ScanAngle) -> Result<f64> {
        let near = self.mesh.natural_neighbor();
        let outside = TextonError::OutsideCalibration {
            orientation_deg: scan.deg(),
            speed_mm_per_s: self.scale.least[1],
        };
        first_crossing(&self.speeds_mm_per_s(), magnitude, outside, |speed| {
            self.interpolate(&near, scan, speed)
        })
    }

    /// A level of this magnitude. Chooses first the orientation whose range over speeds contains the magnitude with the largest
    /// margin, then the speed.
    ///
    /// Candidates are the orientations of the nodes and, if the ranges of two neighbours leave a gap, also orientations
    /// between them.
    ///
    /// # Errors
    /// A magnitude outside the range of the whole table.
    pub fn level_for(&self, magnitude: f64) -> Result<Level> {
        finite("magnitude", magnitude)?;
        let measured = self.orientations();
        let degrees: Vec<f64> = measured.iter().map(|scan| scan.deg()).collect();
        let between = pieces(&degrees).filter_map(|deg| ScanAngle::from_deg(deg).ok());
        let found = self
            .safest(magnitude, measured.iter().copied())
            .or_else(|| self.safest(magnitude, between));
        let (scan, speed_mm_per_s) = found.ok_or_else(|| self.not_attained(magnitude))?;
        Ok(Level {
            scan,
            speed_mm_per_s,
            magnitude,
        })
    }

    fn safest(
        &self,
        magnitude: f64,
        orientations: impl Iterator<Item = ScanAngle>,
    ) -> Option<(ScanAngle, f64)> {
        let near = self.mesh.natural_neighbor();
        let speeds = self.speeds_mm_per_s();
        let mut best: Option<(ScanAngle, f64)> = None;
        for scan in orientations {
            let of = |speed| self.interpolate(&near, scan, speed);
            let (lo, hi) = extent(pieces(&speeds).filter_map(of));
            let margin = (magnitude - lo).min(hi - magnitude);
            // Must be better by more than rounding, so that ties keep the first.
            let better = best.is_none_or(|(_, least)| margin > least + ON * (hi - lo));
            if margin >= 0.0 && better {
                best = Some((scan, margin));
            }
        }
        let (scan, _) = best?;
        Some((scan, self.speed_for(magnitude, scan).ok()?))
    }

    fn not_attained(&self, wanted: f64) -> TextonError {
        let (min, max) = extent(self.nodes.iter().map(|node| node.magnitude));
        TextonError::NotAttained { wanted, min, max }
    }

    fn orientations(&self) -> Vec<ScanAngle> {
        let mut scans: Vec<ScanAngle> = self.nodes.iter().map(|node| node.scan).collect();
        scans.dedup();
        scans
    }

    fn speeds_mm_per_s(&self) -> Vec<f64> {
        let mut speeds: Vec<f64> = self.nodes.iter().map(|n| n.speed_mm_per_s).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup();
        speeds
    }

    fn interpolate(&self, near: &Neighbours<'_>, scan: ScanAngle, speed: f64) -> Option<f64> {
        let at = self.scale.point(scan, speed);
        let nearest = self.mesh.nearest_neighbor(at)?;
        let to = nearest.position();
        if (at.x - to.x).hypot(at.y - to.y) <= ON {
            return Some(nearest.data().magnitude);
        }
        // Sibson's cells are unbounded on the border and numerically too large near it.
        let border = self.mesh.convex_hull().find_map(|edge| {
            let [from, to] = edge.positions();
            let along = [to.x - from.x, to.y - from.y];
            let length = along[0].hypot(along[1]);
            let [dx, dy] = [at.x - from.x, at.y - from.y];
            let share = (dx * along[0] + dy * along[1]) / (length * length);
            let aside = (dx * along[1] - dy * along[0]).abs() / length;
            let [a, b] = edge.vertices().map(|vertex| vertex.data().magnitude);
            (aside <= ON && (0.0..=1.0).contains(&share)).then_some(a + share * (b - a))
        });
        border
            .or_else(|| near.interpolate(|vertex| vertex.data().magnitude, at))
            .filter(|value| value.is_finite())
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| {
        (lo.min(v), hi.max(v))
    })
}

/// The stops, and equal steps between them.
fn pieces(stops: &[f64]) -> impl Iterator<Item = f64> {
    let last = stops.last().copied();
    stops
        .windows(2)
        .flat_map(|w| (0..PIECES).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / PIECES as f64))
        .chain(last)
}

/// The first point at which a function, `None` outside its domain, takes a value; the error `outside` if no
/// stop lies in the domain.
fn first_crossing(
    stops: &[f64],
    wanted: f64,
    outside: TextonError,
    of: impl Fn(f64) -> Option<f64>,
) -> Result<f64> {
    finite("magnitude", wanted)?;
    let mut before: Option<(f64, f64)> = None;
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for at in pieces(stops) {
        let Some(value) = of(at) else {
            before = None;
            continue;
        };
        (min, max) = (min.min(value), max.max(value));
        if value == wanted {
            return Ok(at);
        }
        if let Some((lo, from)) = before.filter(|(_, from)| (from < &wanted) != (value < wanted)) {
            return Ok(bisect(
                lo,
                at,
                |x| of(x).unwrap_or(value) < wanted,
                from < wanted,
            ));
        }
        before = Some((at, value));
    }
    if min > max {
        return Err(outside);
    }
    Err(TextonError::NotAttained { wanted, min, max })
}

/// The point where a condition that is `first` at `lo` and not at `hi` changes, to the last bit.
fn bisect(mut lo: f64, mut hi: f64, holds: impl Fn(f64) -> bool, first: bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if holds(middle) == first {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    hi
}
