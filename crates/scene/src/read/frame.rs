//! What the coordinates of an OBJ mean.

use super::mesh::SurfaceMesh;
use hwall_geometry::{ArgumentError, Pose};
use hwall_numeric::check::positive;

/// Which axis of a file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// z, as in a scene.
    #[default]
    Z,
    /// y: the scene has the axes of [`Pose::Z_UP_FROM_Y_UP`], in which the file's -z becomes x.
    Y,
}

/// Unit and axes of an OBJ. Its sidecar has its axes, but metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileFrame {
    /// Length of a unit, m; default 1.
    pub metres_per_unit: f64,
    /// Default z.
    pub up: UpAxis,
}

impl Default for FileFrame {
    fn default() -> Self {
        Self {
            metres_per_unit: 1.0,
            up: UpAxis::Z,
        }
    }
}

impl FileFrame {
    /// Brings what a file says into metres and z up.
    pub(crate) fn apply(&self, meshes: &mut [SurfaceMesh]) -> Result<(), ArgumentError> {
        let metres = positive("metres per unit", self.metres_per_unit)?;
        let turn = match self.up {
            UpAxis::Z => Pose::IDENTITY,
            UpAxis::Y => Pose::Z_UP_FROM_Y_UP,
        };
        if *self == Self::default() {
            return Ok(());
        }
        for SurfaceMesh {
            surface,
            triangles_m,
        } in meshes
        {
            surface.kind = surface.kind.transformed(&turn);
            for corner_m in triangles_m.iter_mut().flatten() {
                *corner_m = turn.transform_point(*corner_m * metres);
            }
        }
        Ok(())
    }
}
