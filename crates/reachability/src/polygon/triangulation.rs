//! Constrained Delaunay triangulation of rings.

use crate::error::{ReachabilityError, Result};
use crate::wall::WallPoint;
use spade::handles::FixedFaceHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// The triangles inside rings that do not cross, counter-clockwise.
///
/// Indices count the corners of all rings, one ring after the other. A triangle is inside if a path
/// from it to the outside crosses an odd number of ring edges.
///
/// # Errors
/// Rings that cross or meet.
pub(super) fn triangulate<'a>(
    rings: impl Iterator<Item = &'a [WallPoint]>,
) -> Result<Vec<[u32; 3]>> {
    let mut points = Vec::new();
    let mut edges = Vec::new();
    for ring in rings {
        let first = points.len();
        points.extend(ring.iter().map(|p| Point2::new(p.s_m, p.z_m)));
        let last = points.len() - 1;
        edges.extend((first..last).map(|i| [i, i + 1]));
        edges.push([last, first]);
    }
    let (count, edge_count) = (points.len(), edges.len());
    let failed = || ReachabilityError::Triangulation { edges: edge_count };
    let mut conflicts = 0;
    let mesh: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(points, edges, |_| conflicts += 1)
            .map_err(|_| failed())?;
    if conflicts > 0 || mesh.num_vertices() != count {
        return Err(failed());
    }
    // From the outside inwards, by the number of edges crossed.
    let mut inside = vec![None; mesh.num_all_faces()];
    let outer = mesh.outer_face().fix();
    let index = |face: FixedFaceHandle<_>| -> usize { face.index() };
    inside[index(outer)] = Some(false);
    let mut open: Vec<FixedFaceHandle<_>> = Vec::new();
    for edge in mesh.convex_hull() {
        let (at, crossed) = (edge.rev().face().fix(), edge.is_constraint_edge());
        if inside[at.index()].replace(crossed).is_none() {
            open.push(at);
        }
    }
    while let Some(from) = open.pop() {
        let here = inside[from.index()].unwrap_or_default();
        let Some(face) = mesh.face(from).as_inner() else {
            continue;
        };
        for edge in face.adjacent_edges() {
            let to = edge.rev().face().fix();
            if inside[to.index()].is_none() {
                inside[to.index()] = Some(here != edge.is_constraint_edge());
                open.push(to);
            }
        }
    }
    let faces = mesh
        .inner_faces()
        .filter(|f| inside[f.index()] == Some(true));
    Ok(faces
        .map(|face| face.vertices().map(|v| v.index() as u32))
        .collect())
}
