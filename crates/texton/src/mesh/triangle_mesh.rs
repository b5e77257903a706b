//! Triangle meshes, and the check that they are solids.

use crate::error::{Result, TextonError};
use glam::DVec3;
use hwall_numeric::check::finite;

/// Triangles over shared points, mm; counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleMesh {
    points_mm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Size of a mesh, and its defects as a solid.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeshCheck {
    /// Points.
    pub points: usize,
    /// Triangles.
    pub triangles: usize,
    /// Edges of only one triangle: holes in the surface.
    pub open_edges: usize,
    /// Directed edges shared by several triangles: sheets that meet, or neighbours of opposite orientation.
    pub doubled_edges: usize,
    /// Points at which the surface touches itself, or that no triangle uses.
    pub pinched_points: usize,
    /// Triangles without area.
    pub degenerate: usize,
    /// Points less edges plus triangles: 2 for a solid in one piece, 2 less for each hole through it.
    pub euler: i64,
    /// Volume enclosed, mm³; negative if the mesh is inside out.
    pub volume_mm3: f64,
    /// Area of the surface, mm².
    pub area_mm2: f64,
}

impl MeshCheck {
    /// Is every edge shared by exactly two triangles of the same orientation?
    #[must_use]
    pub const fn is_watertight(&self) -> bool {
        self.triangles > 0 && self.open_edges == 0 && self.doubled_edges == 0
    }

    /// Is it the boundary of a solid: watertight, without pinched points, oriented outward, without empty
    /// triangles? Does not detect triangles that pass through each other.
    #[must_use]
    pub fn is_solid(&self) -> bool {
        self.is_watertight()
            && self.pinched_points == 0
            && self.degenerate == 0
            && self.volume_mm3 > 0.0
    }
}

impl TriangleMesh {
    /// A mesh of these points, mm, and triangles.
    ///
    /// # Errors
    /// A coordinate that is not finite, or a triangle with an index beyond the points.
    pub fn new(points_mm: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        for &value in points_mm.iter().flatten() {
            finite("coordinate, mm", value)?;
        }
        if let Some(&index) = triangles
            .iter()
            .flatten()
            .find(|i| **i as usize >= points_mm.len())
        {
            return Err(TextonError::MissingPoint {
                index,
                points: points_mm.len(),
            });
        }
        Ok(Self {
            points_mm,
            triangles,
        })
    }

    /// For meshes whose indices are valid by construction.
    pub(crate) const fn from_parts(points_mm: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            points_mm,
            triangles,
        }
    }

    /// The points, mm.
    #[must_use]
    pub fn points_mm(&self) -> &[[f64; 3]] {
        &self.points_mm
    }

    /// The triangles, as indices of points.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of a triangle, mm.
    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| DVec3::from_array(self.points_mm[i as usize]))
    }

    /// Volume enclosed, mm³, for a watertight mesh.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        // Relative to a point of the mesh: meshes far from the origin then lose no digits.
        let Some(origin) = self.points_mm.first().map(|p| DVec3::from_array(*p)) else {
            return 0.0;
        };
        let six = |t: &[u32; 3]| {
            let [a, b, c] = self.corners(*t).map(|p| p - origin);
            a.dot(b.cross(c))
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// Area of all triangles, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| self.twice_area(*t))
            .sum::<f64>()
            / 2.0
    }

    fn twice_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length()
    }

    /// Checks every edge and every point.
    #[must_use]
    pub fn check(&self) -> MeshCheck {
        let edges = Edges::new(self);
        let mut doubled_edges = 0;
        let mut open_edges = 0;
        let mut pinched_points = 0;
        let mut undirected = 0;
        for middle in 0..self.points_mm.len() as u32 {
            let around = edges.from(middle);
            let Some(&(first, _)) = around.first() else {
                // Not used by any triangle.
                pinched_points += 1;
                continue;
            };
            doubled_edges += around.windows(2).filter(|e| e[0].0 == e[1].0).count();
            for &(to, _) in around {
                let opposite = edges.third(to, middle).is_some();
                open_edges += usize::from(!opposite);
                undirected += i64::from(!opposite || middle < to);
            }
            // Walk from triangle to triangle around the point: one round must visit them all.
            let mut at = first;
            let mut met = 0;
            while let Some(next) = edges.third(middle, at) {
                met += 1;
                at = next;
                if at == first || met > around.len() {
                    break;
                }
            }
            pinched_points += usize::from(met != around.len());
        }
        let degenerate = |t: &&[u32; 3]| {
            let [a, b, c] = **t;
            a == b || b == c || c == a || self.twice_area(**t) == 0.0
        };
        MeshCheck {
            points: self.points_mm.len(),
            triangles: self.triangles.len(),
            open_edges,
            doubled_edges,
            pinched_points,
            degenerate: self.triangles.iter().filter(degenerate).count(),
            euler: self.points_mm.len() as i64 - undirected + self.triangles.len() as i64,
            volume_mm3: self.volume_mm3(),
            area_mm2: self.area_mm2(),
        }
    }
}

/// Directed edges by their first point, each with the third point of its triangle.
struct Edges {
    /// Start of each point's edges; one more entry for the end.
    starts: Vec<usize>,
    /// Second and third point, ascending for each first point.
    ends: Vec<(u32, u32)>,
}

impl Edges {
    fn new(mesh: &TriangleMesh) -> Self {
        let mut starts = vec![0; mesh.points_mm.len() + 1];
        for &i in mesh.triangles.iter().flatten() {
            starts[i as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut free = starts.clone();
        let mut ends = vec![(0, 0); 3 * mesh.triangles.len()];
        for &[a, b, c] in &mesh.triangles {
            for (from, to, third) in [(a, b, c), (b, c, a), (c, a, b)] {
                let at = &mut free[from as usize];
                ends[*at] = (to, third);
                *at += 1;
            }
        }
        for range in starts.windows(2) {
            ends[range[0]..range[1]].sort_unstable();
        }
        Self { starts, ends }
    }

    fn from(&self, point: u32) -> &[(u32, u32)] {
        let i = point as usize;
        &self.ends[self.starts[i]..self.starts[i + 1]]
    }

    /// The third point of the triangle left of an edge.
    fn third(&self, from: u32, to: u32) -> Option<u32> {
        let edges = self.from(from);
        let at = edges.partition_point(|e| e.0 < to);
        edges.get(at).filter(|e| e.0 == to).map(|e| e.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn a_tetrahedron_is_a_solid_and_its_flaws_are_found() {
        let mesh =
            |faces: &[[u32; 3]]| TriangleMesh::new(CORNERS.to_vec(), faces.to_vec()).unwrap();
        let check = mesh(&FACES).check();
        assert!(check.is_solid());
        assert_eq!(check.euler, 2);
        assert!((check.volume_mm3 - 1.0 / 6.0).abs() < 1e-15);
        let open = mesh(&FACES[1..]).check();
        assert_eq!((open.open_edges, open.is_watertight()), (3, false));
        let turned = mesh(&FACES.map(|[a, b, c]| [a, c, b])).check();
        assert!(turned.is_watertight() && !turned.is_solid());
        let mut one_turned = FACES;
        one_turned[2].swap(0, 1);
        assert!(!mesh(&one_turned).check().is_watertight());
        assert!(!TriangleMesh::default().check().is_watertight());
    }

    #[test]
    fn solids_that_touch_at_a_point_are_pinched() {
        let mut points = CORNERS.to_vec();
        points.extend(CORNERS[1..].iter().map(|p| p.map(|x| -x)));
        let mut faces = FACES.to_vec();
        let far = |i: u32| if i == 0 { 0 } else { i + 3 };
        faces.extend(FACES.map(|[a, b, c]| [far(a), far(c), far(b)]));
        let check = TriangleMesh::new(points, faces).unwrap().check();
        assert!(check.is_watertight());
        assert_eq!(check.pinched_points, 1);
    }

    #[test]
    fn missing_points_and_nan_are_refused() {
        let missing = TriangleMesh::new(CORNERS.to_vec(), vec![[0, 1, 4]]);
        assert!(matches!(
            missing,
            Err(TextonError::MissingPoint {
                index: 4,
                points: 4
            })
        ));
        assert!(TriangleMesh::new(vec![[f64::NAN; 3]], vec![]).is_err());
    }
}
