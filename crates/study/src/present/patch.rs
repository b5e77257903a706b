//! Printed patches of a texture that stand on the board.

use hwall::texton::{Texton, Texture};
use serde::{Deserialize, Serialize};

/// A printed patch on the board, of the dissertation's studies. In a study with people, the experimenter exchanges it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Patch {
    /// [`Texture::study_1_5`].
    #[serde(rename = "study-1.5")]
    R1_5,
    /// [`Texture::study_2`].
    #[serde(rename = "study-2")]
    R2,
    /// [`Texture::study_2_5`].
    #[serde(rename = "study-2.5")]
    R2_5,
    /// [`Texture::study_3`]: hemiellipsoids with a long radius of 3 mm.
    #[serde(rename = "study-3")]
    R3,
    /// Truncated cones with the same base, height and grid as `R3`, and sides of 45 degrees.
    #[serde(rename = "cones-3")]
    Cones3,
}

impl Patch {
    /// All patches.
    pub const ALL: [Self; 5] = [Self::R1_5, Self::R2, Self::R2_5, Self::R3, Self::Cones3];

    /// Its number, 1 to 5. Numbers are not in the order of size, so they reveal nothing to a subject.
    #[must_use]
    pub const fn number(self) -> usize {
        match self {
            Self::R1_5 => 4,
            Self::R2 => 1,
            Self::R2_5 => 5,
            Self::R3 => 2,
            Self::Cones3 => 3,
        }
    }

    /// As one word, as in the levels of a factor; the words for hemiellipsoids are also presets of `texture_patch`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::R1_5 => "study-1.5",
            Self::R2 => "study-2",
            Self::R2_5 => "study-2.5",
            Self::R3 => "study-3",
            Self::Cones3 => "cones-3",
        }
    }

    /// Its bumps and their grid.
    ///
    /// # Panics
    /// Never: cones on the base of the hemiellipsoids have the same spacing.
    #[must_use]
    pub fn texture(self) -> Texture {
        match self {
            Self::R1_5 => Texture::study_1_5(),
            Self::R2 => Texture::study_2(),
            Self::R2_5 => Texture::study_2_5(),
            Self::R3 => Texture::study_3(),
            Self::Cones3 => {
                let like = Texture::study_3();
                let (bump, grid) = (like.texton(), *like.layout());
                Texton::truncated_cone(bump.radii(), bump.height_mm())
                    .and_then(|cone| Texture::new(cone, grid))
                    .expect("the bumps of a preset are apart")
            }
        }
    }
}
