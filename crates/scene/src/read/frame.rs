//! Unit and axes of an OBJ's coordinates.

use super::mesh::SurfaceMesh;
use hwall_geometry::{ArgumentError, Pose};
use hwall_numeric::check::positive;

/// Unit and axes of an OBJ. Its sidecar uses the same axes, but metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileFrame {
    /// Length of a unit, m; default 1.
    pub metres_per_unit: f64,
    /// True if y is up; the scene is then converted by [`Pose::Z_UP_FROM_Y_UP`]: the file's -z becomes x. Default false: z is up.
    pub y_up: bool,
}

impl Default for FileFrame {
    fn default() -> Self {
        Self {
            metres_per_unit: 1.0,
            y_up: false,
        }
    }
}

impl FileFrame {
    /// Converts meshes to metres and z up.
    pub(crate) fn apply(&self, meshes: &mut [SurfaceMesh]) -> Result<(), ArgumentError> {
        let metres = positive("metres per unit", self.metres_per_unit)?;
        for mesh in meshes.iter_mut().filter(|_| self.y_up) {
            let kind = &mut mesh.surface.kind;
            *kind = kind.transformed(&Pose::Z_UP_FROM_Y_UP);
            let corners_m = mesh.triangles_m.iter_mut().flatten();
            corners_m.for_each(|p| *p = Pose::Z_UP_FROM_Y_UP.transform_point(*p));
        }
        let corners_m = meshes.iter_mut().flat_map(|mesh| &mut mesh.triangles_m);
        corners_m.flatten().for_each(|p| *p *= metres);
        Ok(())
    }
}
