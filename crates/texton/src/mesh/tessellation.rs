//! How finely a curved surface is cut into triangles.

use crate::TextonError;

/// Where triangles lie with respect to the true surface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ChordSide {
    /// Corners on the surface, triangles inside by up to the accuracy: sizes and heights are exact,
    /// volumes smaller.
    #[default]
    Inside,
    /// Corners outside by the accuracy, triangles inside by up to the accuracy: about half as many
    /// triangles and a smaller error of the volume, with bumps larger by the accuracy all around.
    /// Of hemiellipsoids; cones keep their corners on the surface.
    Both,
}

/// What a mesh has to keep to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tessellation {
    /// Largest distance of the mesh from the true surface, mm, 0.001 to 1. Printers resolve about
    /// 0.05; the default of 0.01 leaves room for them.
    pub accuracy_mm: f64,
    /// On which side of the surface that may be.
    pub side: ChordSide,
    /// Meshes with more triangles are refused before memory is taken. A million takes about 25 MB.
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
    /// With this accuracy, mm, else as the default.
    #[must_use]
    pub fn with_accuracy_mm(accuracy_mm: f64) -> Self {
        Self {
            accuracy_mm,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), TextonError> {
        if (0.001..=1.0).contains(&self.accuracy_mm) {
            return Ok(());
        }
        Err(TextonError::Parameter {
            what: "accuracy_mm",
            value: self.accuracy_mm,
            wanted: "0.001 to 1",
        })
    }
}
