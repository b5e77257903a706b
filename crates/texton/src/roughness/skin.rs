//! The skin as a blur over a texture.

use glam::DVec2;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;

/// A smaller blur would need too many waves; skin blurs ten times as much.
const LEAST_BLUR_MM: f64 = 0.05;

/// A Gaussian blur.
#[derive(Debug, Clone, Copy)]
pub(super) struct Skin {
    blur_mm: f64,
}

impl Skin {
    /// With this standard deviation, mm.
    ///
    /// # Errors
    /// Below 0.05 mm, NaN or infinite.
    pub(super) fn new(blur_mm: f64) -> Result<Self, ArgumentError> {
        that(
            blur_mm >= LEAST_BLUR_MM && blur_mm.is_finite(),
            "blur_mm",
            blur_mm,
            "a finite number of at least 0.05",
        )?;
        Ok(Self { blur_mm })
    }

    /// Fraction of a wave's amplitude after the blur, 0 to 1.
    pub(super) fn gain(self, wave_rad_per_mm: DVec2) -> f64 {
        (-0.5 * wave_rad_per_mm.length_squared() * self.blur_mm * self.blur_mm).exp()
    }

    /// Beyond this wave number waves keep less than exp(-16) = 1.13e-7 of their power, rad/mm.
    pub(super) fn limit_rad_per_mm(self) -> f64 {
        4.0 / self.blur_mm
    }
}
