//! Textures of the dissertation.

use crate::{Layout, Texton, TextonError, Texture};

/// Height of the bumps of every preset, mm.
const HEIGHT_MM: f64 = 0.7;

impl Texture {
    /// The texture of the released patch: radii 3 and 1 mm, pitch 6.2 x 2.2 mm.
    ///
    /// The dissertation's text asks for a short radius of 1.5 mm so that spacings stay above 3 mm;
    /// its studies and its released patch use 1 mm and a short pitch of 2.2 mm.
    #[must_use]
    pub fn released() -> Self {
        preset([3.0, 1.0], [6.2, 2.2])
    }

    /// As the dissertation's text has it, with spacings of 3 mm and above: pitch 7 x 3 mm.
    #[must_use]
    pub fn spaced_3_mm() -> Self {
        preset([3.0, 1.0], [7.0, 3.0])
    }

    /// Patch of the preliminary study with a long radius of 1.5 mm: pitch 3.5 x 3.5 mm.
    #[must_use]
    pub fn study_1_5() -> Self {
        preset([1.5, 1.0], [3.5, 3.5])
    }

    /// Patch of the preliminary study with a long radius of 2 mm: pitch 4.5 x 2.25 mm.
    #[must_use]
    pub fn study_2() -> Self {
        preset([2.0, 1.0], [4.5, 2.25])
    }

    /// Patch of the preliminary study with a long radius of 2.5 mm: pitch 5.5 x 2.75 mm.
    #[must_use]
    pub fn study_2_5() -> Self {
        preset([2.5, 1.0], [5.5, 2.75])
    }

    /// Patch of the preliminary study with a long radius of 3 mm: pitch 6.5 x 13/6 mm.
    #[must_use]
    pub fn study_3() -> Self {
        preset([3.0, 1.0], [6.5, 6.5 / 3.0])
    }

    /// Hemiellipsoids on a rectangular grid: radii, height and pitches, mm.
    ///
    /// # Errors
    /// As [`Texton::new`] and [`Texture::new`].
    pub fn hemiellipsoids(
        radii_mm: [f64; 2],
        height_mm: f64,
        [long_mm, short_mm]: [f64; 2],
    ) -> Result<Self, TextonError> {
        let texton = Texton::hemiellipsoid(radii_mm, height_mm)?;
        Self::new(texton, Layout::Rectangular { long_mm, short_mm })
    }
}

fn preset(radii_mm: [f64; 2], pitch_mm: [f64; 2]) -> Texture {
    Texture::hemiellipsoids(radii_mm, HEIGHT_MM, pitch_mm)
        .expect("the bumps of the presets are apart")
}
