//! Bumps and textures by their numbers.

use hwall_texton::{Layout, Radii, Texton, TextonError, Texture};

/// Long and short radius, mm.
pub(crate) const fn radii(long_mm: f64, short_mm: f64) -> Radii {
    Radii { long_mm, short_mm }
}

/// Hemiellipsoids on a rectangular grid of long and short pitch, mm.
pub(crate) fn hemiellipsoids(
    radii: Radii,
    height_mm: f64,
    [long_mm, short_mm]: [f64; 2],
) -> Result<Texture, TextonError> {
    let texton = Texton::hemiellipsoid(radii, height_mm)?;
    Texture::new(texton, Layout::Rectangular { long_mm, short_mm })
}
