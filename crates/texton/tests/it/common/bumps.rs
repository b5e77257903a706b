//! Bumps and textures by their numbers.

use hwall_texton::{
    Layout, Level, PatchSpec, Radii, RoughnessModel, ScanAngle, Texton, TextonError, Texture,
};

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

/// Bumps of 6 x 2 x 0.7 mm whose rows are moved by half a pitch.
pub(crate) fn staggered(long_mm: f64, short_mm: f64) -> Result<Texture, TextonError> {
    let texton = Texton::hemiellipsoid(radii(3.0, 1.0), 0.7)?;
    Texture::new(texton, Layout::Staggered { long_mm, short_mm })
}

/// A truncated cone of 6 x 2 x 0.7 mm.
pub(crate) fn cone() -> Texton {
    Texton::truncated_cone(radii(3.0, 1.0), 0.7).unwrap()
}

/// A texton where the released texture has its bumps.
pub(crate) fn on_released_grid(texton: Texton) -> Texture {
    Texture::new(texton, *Texture::released().layout()).unwrap()
}

/// The roughness that a model predicts.
pub(crate) fn roughness(
    model: &dyn RoughnessModel,
    texture: &Texture,
    scan: ScanAngle,
    speed_mm_per_s: f64,
) -> f64 {
    let prediction = model.predict(texture, scan, speed_mm_per_s).unwrap();
    prediction.value().unwrap()
}

/// A patch of a size in one piece.
pub(crate) fn sized(size_mm: [f64; 2]) -> PatchSpec {
    PatchSpec {
        size_mm,
        ..PatchSpec::default()
    }
}

pub(crate) fn scan(deg: f64) -> ScanAngle {
    ScanAngle::from_deg(deg).unwrap()
}

pub(crate) fn level(deg: f64, speed_mm_per_s: f64, magnitude: f64) -> Level {
    Level {
        scan: scan(deg),
        speed_mm_per_s,
        magnitude,
    }
}
