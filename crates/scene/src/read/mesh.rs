//! Checks and repairs of triangles when a scene is loaded.

use crate::error::{Result, SceneError};
use crate::part::triangle::{self, Triangle, is_usable};
use crate::surface::{Surface, validated};
use glam::DVec3;
use std::collections::HashSet;

/// A surface and its triangles, corners in metres, counter-clockwise from outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceMesh {
    /// Name and properties.
    pub surface: Surface,
    /// Triangles; both sides can be touched and hit.
    pub triangles_m: Vec<[DVec3; 3]>,
}

/// What was dropped or repaired when loading a scene. All zero for a clean file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LoadReport {
    /// Dropped faces with an area of zero or below the rounding of the scene.
    pub degenerate_faces: usize,
    /// Dropped faces with the same corners as an earlier one (in any order, on any surface that moves with it).
    pub duplicate_faces: usize,
    /// Polygons that cross themselves, or that are not convex and have more than 256 corners; they are cut as fans, so pieces may overlap.
    pub concave_polygons: usize,
    /// Dropped points, lines and faces with fewer than three corners.
    pub points_and_lines: usize,
    /// Dropped lines with an unknown keyword.
    pub ignored_lines: usize,
    /// Surfaces that lost degenerate or duplicate faces.
    pub thinned_surfaces: Vec<String>,
    /// Dropped surfaces without any remaining face.
    pub empty_surfaces: Vec<String>,
    /// Material libraries that are missing or malformed.
    pub missing_material_libraries: Vec<String>,
    /// Materials that are used but not defined.
    pub missing_materials: Vec<String>,
}

impl LoadReport {
    /// True if nothing was dropped or repaired.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        *self == Self::default()
    }
}

/// Checks every number, drops unusable faces and surfaces without faces.
pub(crate) fn repaired(
    meshes: Vec<SurfaceMesh>,
    report: &mut LoadReport,
) -> Result<Vec<SurfaceMesh>> {
    let all = meshes
        .iter()
        .flat_map(|mesh| coordinates(&mesh.triangles_m));
    // Unusable coordinates are rejected below.
    let reach_m = all
        .filter(|x| is_usable(*x))
        .fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut names = HashSet::new();
    let mut seen = HashSet::new();
    let mut kept = Vec::with_capacity(meshes.len());
    for SurfaceMesh {
        surface,
        mut triangles_m,
    } in meshes
    {
        if !names.insert(surface.name.clone()) {
            return Err(SceneError::DuplicateSurface { name: surface.name });
        }
        let surface = validated(surface)?;
        if let Some(value) = coordinates(&triangles_m).find(|x| !is_usable(*x)) {
            let (what, wanted) = ("vertex coordinate", "finite and below 1e9 m");
            return Err(SceneError::parameter(&surface.name, what, value, wanted));
        }
        let given = triangles_m.len();
        triangles_m.retain(|t| {
            let degenerate = triangle::is_degenerate(t) || triangle::is_lost(t, reach_m);
            report.degenerate_faces += usize::from(degenerate);
            !degenerate
        });
        // A door moves, so only faces of surfaces that move together coincide permanently.
        if surface.kind.range().is_some() {
            seen.clear();
        }
        triangles_m.retain(|t| {
            let new = seen.insert(key(t));
            report.duplicate_faces += usize::from(!new);
            new
        });
        if surface.kind.range().is_some() {
            seen.clear();
        }
        if triangles_m.len() < given {
            report.thinned_surfaces.push(surface.name.clone());
        }
        if triangles_m.is_empty() {
            report.empty_surfaces.push(surface.name);
        } else {
            kept.push(SurfaceMesh {
                surface,
                triangles_m,
            });
        }
    }
    if kept.is_empty() {
        Err(SceneError::NoFaces)
    } else {
        Ok(kept)
    }
}

fn coordinates(triangles: &[Triangle]) -> impl Iterator<Item = f64> + '_ {
    triangles.iter().flatten().flat_map(|p| p.to_array())
}

/// A key independent of the order of the corners.
fn key(triangle: &Triangle) -> [[u64; 3]; 3] {
    // Adding zero turns -0 into 0.
    let mut corners = triangle.map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
    corners.sort_unstable();
    corners
}
