//! Fineness of the triangles of a curved surface.

use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;

/// Where triangles lie with respect to the true surface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ChordSide {
    /// Corners on the surface, triangles inside by up to the accuracy: exact sizes and heights,
    /// smaller volume.
    #[default]
    Inside,
    /// Corners outside by the accuracy, triangles inside by up to the accuracy: about half as many triangles and a
    /// smaller volume error, but bumps are larger by the accuracy on all sides. Hemiellipsoids only; cones keep
    /// their corners on the surface.
    Both,
}

/// Accuracy and size limit of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tessellation {
    /// Largest distance of the mesh from the true surface, mm, 0.001 to 1; default 0.01. Printers resolve about 0.05.
    pub accuracy_mm: f64,
    /// On which side of the surface the mesh may lie.
    pub side: ChordSide,
    /// Meshes with more triangles are refused before memory is allocated. A million takes about 25 MB.
    pub max_triangles: u64,
}

impl Default for Tessellation {
    fn default() -> Self {
        Self {
            accuracy_mm: 0.01,
            side: ChordSide::Inside,
            max_triangles: 20_000_000,
        }
    }
}

impl Tessellation {
    /// With this accuracy, mm, and otherwise default settings.
    #[must_use]
    pub fn with_accuracy_mm(accuracy_mm: f64) -> Self {
        Self {
            accuracy_mm,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ArgumentError> {
        let holds = (0.001..=1.0).contains(&self.accuracy_mm);
        that(holds, "accuracy_mm", self.accuracy_mm, "0.001 to 1")?;
        Ok(())
    }
}
