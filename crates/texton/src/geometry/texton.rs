//! One bump.

use crate::error::positive;
use crate::{ScanAngle, TextonError};
use std::f64::consts::{FRAC_PI_2, PI};

/// What a bump looks like from the side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TextonShape {
    /// The upper half of an ellipsoid.
    Hemiellipsoid,
    /// An elliptic cone cut off flat, the comparison texton of the studies: the top's radii are both
    /// smaller by `height / tan(side_rad)`. Beside the axes the side is steeper than along them, see
    /// [`Texton::steepest_rad`].
    TruncatedCone {
        /// Angle of the side against the plate along both axes, rad; 45 degrees in the studies.
        side_rad: f64,
    },
}

/// A bump on a plate: an ellipse at its base, its long axis along x, and a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texton {
    shape: TextonShape,
    long_mm: f64,
    short_mm: f64,
    height_mm: f64,
}

impl Texton {
    /// A bump with these radii at its base.
    ///
    /// # Errors
    /// A length that is no positive number; a short radius above the long one; a cone whose sides
    /// meet below its top, or lean outwards.
    pub fn new(
        shape: TextonShape,
        [long_mm, short_mm]: [f64; 2],
        height_mm: f64,
    ) -> Result<Self, TextonError> {
        positive("long radius, mm", long_mm)?;
        positive("short radius, mm", short_mm)?;
        positive("height, mm", height_mm)?;
        if short_mm > long_mm {
            return Err(TextonError::Parameter {
                what: "short radius, mm",
                value: short_mm,
                wanted: "at most the long radius",
            });
        }
        if let TextonShape::TruncatedCone { side_rad } = shape {
            let inset_mm = height_mm / side_rad.tan();
            let outward = !(side_rad > 0.0 && side_rad <= FRAC_PI_2);
            if outward || inset_mm >= short_mm {
                return Err(TextonError::Parameter {
                    what: "side_rad",
                    value: side_rad,
                    wanted: "in (atan(height / short radius), pi/2]",
                });
            }
        }
        Ok(Self {
            shape,
            long_mm,
            short_mm,
            height_mm,
        })
    }

    /// A hemiellipsoid.
    ///
    /// # Errors
    /// As [`Texton::new`].
    pub fn hemiellipsoid(radii_mm: [f64; 2], height_mm: f64) -> Result<Self, TextonError> {
        Self::new(TextonShape::Hemiellipsoid, radii_mm, height_mm)
    }

    /// A truncated cone with sides of 45 degrees along both axes.
    ///
    /// # Errors
    /// As [`Texton::new`].
    pub fn truncated_cone(radii_mm: [f64; 2], height_mm: f64) -> Result<Self, TextonError> {
        let side_rad = 0.5 * FRAC_PI_2;
        Self::new(TextonShape::TruncatedCone { side_rad }, radii_mm, height_mm)
    }

    /// The shape.
    #[must_use]
    pub const fn shape(&self) -> TextonShape {
        self.shape
    }

    /// Long and short radius of the base, mm.
    #[must_use]
    pub const fn radii_mm(&self) -> [f64; 2] {
        [self.long_mm, self.short_mm]
    }

    /// Height, mm.
    #[must_use]
    pub const fn height_mm(&self) -> f64 {
        self.height_mm
    }

    /// Radii of the flat top, mm; zero for a hemiellipsoid.
    #[must_use]
    pub fn top_radii_mm(&self) -> [f64; 2] {
        match self.shape {
            TextonShape::Hemiellipsoid => [0.0; 2],
            TextonShape::TruncatedCone { side_rad } => {
                let inset_mm = self.height_mm / side_rad.tan();
                self.radii_mm().map(|radius_mm| radius_mm - inset_mm)
            }
        }
    }

    /// `w(θ) = 2 √(r_x² cos² θ + r_y² sin² θ)`, equation V.1 of the dissertation, mm: it takes this for
    /// the width felt along a scan.
    #[must_use]
    pub fn width_mm(&self, scan: ScanAngle) -> f64 {
        2.0 * (self.long_mm * scan.cos()).hypot(self.short_mm * scan.sin())
    }

    /// How broad the bump is across the scan, `2 √(r_x² sin² θ + r_y² cos² θ)`, mm.
    #[must_use]
    pub fn breadth_mm(&self, scan: ScanAngle) -> f64 {
        2.0 * (self.long_mm * scan.sin()).hypot(self.short_mm * scan.cos())
    }

    /// How far a finger's centre line stays on a bump that it meets in the middle, mm:
    /// `2 / √(cos² θ / r_x² + sin² θ / r_y²)`.
    #[must_use]
    pub fn contact_length_mm(&self, scan: ScanAngle) -> f64 {
        2.0 / (scan.cos() / self.long_mm).hypot(scan.sin() / self.short_mm)
    }

    /// Volume above the plate, mm³.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        let [a, b] = self.radii_mm();
        match self.shape {
            TextonShape::Hemiellipsoid => 2.0 / 3.0 * PI * a * b * self.height_mm,
            // Between two ellipses that shrink linearly with height: the integral of both radii.
            TextonShape::TruncatedCone { .. } => {
                let [c, d] = self.top_radii_mm();
                PI * self.height_mm / 6.0 * (2.0 * a * b + a * d + c * b + 2.0 * c * d)
            }
        }
    }

    /// Area of the base, mm².
    #[must_use]
    pub fn base_area_mm2(&self) -> f64 {
        PI * self.long_mm * self.short_mm
    }
}
