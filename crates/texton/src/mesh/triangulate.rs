//! Triangles of a plane region between closed outlines.

use crate::error::{Result, TextonError};
use spade::handles::FixedFaceHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A corner and its index in the caller's list.
struct Corner {
    at: Point2<f64>,
    index: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The sides of a closed outline over points that follow each other.
pub(crate) fn outline(first: u32, count: u32) -> impl Iterator<Item = [u32; 2]> {
    (0..count).map(move |i| [first + i, first + (i + 1) % count])
}

/// Counter-clockwise triangles of the region inside an odd number of closed outlines.
///
/// `points`: the points of the outlines, and any others to use inside. `sides`: the sides of all
/// outlines, in any order. Adds no points, so equal outlines of neighbouring regions fit together.
/// Outlines may share points but not cross.
///
/// # Errors
/// Outlines that cross, or points that coincide.
pub(crate) fn inside(points: &[[f64; 2]], sides: &[[u32; 2]]) -> Result<Vec<[u32; 3]>> {
    let corners = (0..).zip(points).map(|(index, &[x, y])| Corner {
        at: Point2::new(x, y),
        index,
    });
    let edges: Vec<[usize; 2]> = sides.iter().map(|s| s.map(|i| i as usize)).collect();
    let wanted = edges.len();
    let mut conflicts = 0;
    let mesh = ConstrainedDelaunayTriangulation::<Corner>::try_bulk_load_cdt(
        corners.collect(),
        edges,
        |_| conflicts += 1,
    )
    .map_err(|_| TextonError::Triangulation { conflicts })?;
    // A point on the outline of another would split an edge and open a seam.
    if conflicts > 0 || mesh.num_vertices() != points.len() || mesh.num_constraints() != wanted {
        return Err(TextonError::Triangulation { conflicts });
    }
    // Across an outline, inside changes to outside and back.
    let mut is_inside: Vec<Option<bool>> = vec![None; mesh.num_all_faces()];
    let outer: FixedFaceHandle<_> = mesh.outer_face().fix();
    is_inside[outer.index()] = Some(false);
    let mut to_do = Vec::new();
    for edge in mesh.convex_hull() {
        // One of the two faces is the outer one.
        for edge in [edge, edge.rev()] {
            if let Some(face) = edge.face().as_inner() {
                is_inside[face.fix().index()] = Some(edge.is_constraint_edge());
                to_do.push(face.fix());
            }
        }
    }
    while let Some(face) = to_do.pop() {
        let here = is_inside[face.index()] == Some(true);
        for edge in mesh.face(face).adjacent_edges() {
            let Some(next) = edge.rev().face().as_inner() else {
                continue;
            };
            let state = &mut is_inside[next.fix().index()];
            if state.is_none() {
                *state = Some(here != edge.is_constraint_edge());
                to_do.push(next.fix());
            }
        }
    }
    Ok(mesh
        .inner_faces()
        .filter(|face| is_inside[face.fix().index()] == Some(true))
        .map(|face| face.vertices().map(|v| v.data().index))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_outlines_and_coinciding_points_are_refused() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let crossing = inside(&square, &[[0, 2], [2, 1], [1, 3], [3, 0]]);
        assert!(matches!(crossing, Err(TextonError::Triangulation { .. })));
        let sides: Vec<[u32; 2]> = outline(0, 3).collect();
        for last in [[0.0; 2], [f64::NAN, 1.0]] {
            let refused = inside(&[[0.0; 2], [1.0, 0.0], last], &sides);
            assert!(matches!(refused, Err(TextonError::Triangulation { .. })));
        }
    }
}
