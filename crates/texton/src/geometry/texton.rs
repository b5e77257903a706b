//! One bump.

use super::closest::ellipsoid_distance;
use super::scan::ScanAngle;
use crate::error::Result;
use glam::{DVec2, DVec3};
use hwall_numeric::check::{positive, that};
use std::f64::consts::{FRAC_PI_2, PI};

/// Shape of a bump, seen from the side.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum TextonShape {
    /// The upper half of an ellipsoid.
    Hemiellipsoid,
    /// An elliptic cone with a flat top, the comparison texton of the studies: both radii of the top are
    /// smaller by `height / tan(side_rad)`. The side is steeper between the axes than along them, see
    /// [`Texton::steepest_rad`].
    TruncatedCone {
        /// Angle of the side against the plate along both axes, rad; 45 degrees in the studies.
        side_rad: f64,
    },
}

/// Radii of an ellipse, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    /// Along the long axis of the bump, x.
    pub long_mm: f64,
    /// Along the short axis, y.
    pub short_mm: f64,
}

impl Radii {
    /// Along x and along y, mm.
    #[must_use]
    pub const fn to_array(self) -> [f64; 2] {
        [self.long_mm, self.short_mm]
    }
}

/// A bump on a plate: an ellipse at its base, its long axis along x, and a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texton {
    shape: TextonShape,
    radii: Radii,
    height_mm: f64,
}

impl Texton {
    /// A bump with these radii at its base.
    ///
    /// # Errors
    /// A length that is not positive; a short radius above the long one; a cone whose sides meet below
    /// its top, or lean outwards.
    pub fn new(shape: TextonShape, radii: Radii, height_mm: f64) -> Result<Self> {
        let Radii { long_mm, short_mm } = radii;
        positive("long radius, mm", long_mm)?;
        positive("short radius, mm", short_mm)?;
        positive("height, mm", height_mm)?;
        that(
            short_mm <= long_mm,
            "short radius, mm",
            short_mm,
            "at most the long radius",
        )?;
        if let TextonShape::TruncatedCone { side_rad } = shape {
            let inset_mm = height_mm / side_rad.tan();
            that(
                side_rad > 0.0 && side_rad <= FRAC_PI_2 && inset_mm < short_mm,
                "side_rad",
                side_rad,
                "in (atan(height / short radius), pi/2]",
            )?;
        }
        Ok(Self {
            shape,
            radii,
            height_mm,
        })
    }

    /// A hemiellipsoid.
    ///
    /// # Errors
    /// As [`Texton::new`].
    pub fn hemiellipsoid(radii: Radii, height_mm: f64) -> Result<Self> {
        Self::new(TextonShape::Hemiellipsoid, radii, height_mm)
    }

    /// A truncated cone with sides of 45 degrees along both axes.
    ///
    /// # Errors
    /// As [`Texton::new`].
    pub fn truncated_cone(radii: Radii, height_mm: f64) -> Result<Self> {
        let side_rad = 0.5 * FRAC_PI_2;
        Self::new(TextonShape::TruncatedCone { side_rad }, radii, height_mm)
    }

    /// The shape.
    #[must_use]
    pub const fn shape(&self) -> TextonShape {
        self.shape
    }

    /// Radii of the base.
    #[must_use]
    pub const fn radii(&self) -> Radii {
        self.radii
    }

    /// Height, mm.
    #[must_use]
    pub const fn height_mm(&self) -> f64 {
        self.height_mm
    }

    /// Radii of the flat top; zero for a hemiellipsoid.
    #[must_use]
    pub fn top_radii(&self) -> Radii {
        match self.shape {
            TextonShape::Hemiellipsoid => Radii {
                long_mm: 0.0,
                short_mm: 0.0,
            },
            TextonShape::TruncatedCone { side_rad } => {
                let inset_mm = self.height_mm / side_rad.tan();
                Radii {
                    long_mm: self.radii.long_mm - inset_mm,
                    short_mm: self.radii.short_mm - inset_mm,
                }
            }
        }
    }

    /// `w(θ) = 2 √(r_x² cos² θ + r_y² sin² θ)`, mm: equation V.1 of the dissertation, which takes this for
    /// the width felt along a scan.
    #[must_use]
    pub fn width_mm(&self, scan: ScanAngle) -> f64 {
        2.0 * (self.radii.long_mm * scan.cos()).hypot(self.radii.short_mm * scan.sin())
    }

    /// Width of the bump across the scan, `2 √(r_x² sin² θ + r_y² cos² θ)`, mm.
    #[must_use]
    pub fn breadth_mm(&self, scan: ScanAngle) -> f64 {
        2.0 * (self.radii.long_mm * scan.sin()).hypot(self.radii.short_mm * scan.cos())
    }

    /// Length of a finger's centre line on a bump that it crosses through the middle, mm:
    /// `2 / √(cos² θ / r_x² + sin² θ / r_y²)`.
    #[must_use]
    pub fn contact_length_mm(&self, scan: ScanAngle) -> f64 {
        2.0 / (scan.cos() / self.radii.long_mm).hypot(scan.sin() / self.radii.short_mm)
    }

    /// Volume above the plate, mm³.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        let [a, b] = self.radii.to_array();
        match self.shape {
            TextonShape::Hemiellipsoid => 2.0 / 3.0 * PI * a * b * self.height_mm,
            // Between two ellipses that shrink linearly with height: the integral of both radii.
            TextonShape::TruncatedCone { .. } => {
                let [c, d] = self.top_radii().to_array();
                PI * self.height_mm / 6.0 * (2.0 * a * b + a * d + c * b + 2.0 * c * d)
            }
        }
    }

    /// Area of the base, mm².
    #[must_use]
    pub fn base_area_mm2(&self) -> f64 {
        PI * self.radii.long_mm * self.radii.short_mm
    }

    /// Height of the surface above the plate, mm, at a place relative to the middle of the bump, mm;
    /// zero outside the bump.
    #[must_use]
    pub fn height_at_mm(&self, at_mm: DVec2) -> f64 {
        let DVec2 { x: x_mm, y: y_mm } = at_mm;
        let [a, b] = self.radii.to_array();
        match self.shape {
            TextonShape::Hemiellipsoid => {
                let (x, y) = (x_mm / a, y_mm / b);
                self.height_mm * (1.0 - x * x - y * y).max(0.0).sqrt()
            }
            TextonShape::TruncatedCone { .. } => {
                // The fraction of the height at which the shrinking ellipse meets this point.
                let [c, d] = self.top_radii().to_array();
                let beside = |share: f64| {
                    let (x, y) = (a + share * (c - a), b + share * (d - b));
                    (x_mm / x).hypot(y_mm / y) - 1.0
                };
                if beside(0.0) >= 0.0 {
                    return 0.0;
                }
                if beside(1.0) <= 0.0 {
                    return self.height_mm;
                }
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..54 {
                    let middle = 0.5 * (low + high);
                    if beside(middle) < 0.0 {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                self.height_mm * 0.5 * (low + high)
            }
        }
    }

    /// Steepest angle of the sides against the plate, rad: π/2 at the foot of a hemiellipsoid.
    ///
    /// For a cone it is `atan(tan(side) (c + d) / (2 √(c d)))`, where `c` and `d` are the radii of its top: both radii of the
    /// ellipse shrink by the same length, but between the axes the ellipse shrinks less, and least at the top.
    #[must_use]
    pub fn steepest_rad(&self) -> f64 {
        match self.shape {
            TextonShape::Hemiellipsoid => std::f64::consts::FRAC_PI_2,
            TextonShape::TruncatedCone { side_rad } => {
                let [c, d] = self.top_radii().to_array();
                let skew = 0.5 * ((c / d).sqrt() + (d / c).sqrt());
                (side_rad.tan() * skew).atan()
            }
        }
    }

    /// Distance of a point, relative to the middle of the bump, from its rounded side, mm: the whole
    /// ellipsoid, or the elliptic cone without its top.
    pub(crate) fn side_distance_mm(&self, point_mm: DVec3) -> f64 {
        let [a, b] = self.radii.to_array();
        match self.shape {
            TextonShape::Hemiellipsoid => {
                ellipsoid_distance([a, b, self.height_mm], point_mm.to_array())
            }
            TextonShape::TruncatedCone { .. } => self.cone_distance_mm(point_mm),
        }
    }

    /// Iterates along the gradient and in the tangent plane; for points near the surface.
    fn cone_distance_mm(&self, point: DVec3) -> f64 {
        let [a, b] = self.radii.to_array();
        let [c, d] = self.top_radii().to_array();
        let h = self.height_mm;
        let mut at = point;
        for _ in 0..8 {
            let share = at.z / h;
            let (x, y) = (a + share * (c - a), b + share * (d - b));
            let (u, v) = (at.x / x, at.y / y);
            let value = u * u + v * v - 1.0;
            let fall = u * u * (c - a) / (h * x) + v * v * (d - b) / (h * y);
            let gradient = 2.0 * glam::dvec3(u / x, v / y, -fall);
            let square = gradient.length_squared();
            let away = point - at;
            let along = away - gradient * (away.dot(gradient) / square);
            let step = along - gradient * (value / square);
            at += step;
            if step.length_squared() < 1e-24 {
                break;
            }
        }
        at.distance(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec2, dvec3};

    const RADII: Radii = Radii {
        long_mm: 3.0,
        short_mm: 1.0,
    };

    #[test]
    fn heights_lie_on_the_surface() {
        for texton in [
            Texton::hemiellipsoid(RADII, 0.7).unwrap(),
            Texton::truncated_cone(RADII, 0.7).unwrap(),
        ] {
            assert_eq!(texton.height_at_mm(dvec2(0.0, 0.0)), 0.7);
            assert_eq!(texton.height_at_mm(dvec2(3.0, 0.0)), 0.0);
            assert_eq!(texton.height_at_mm(dvec2(2.0, -1.0)), 0.0);
            for [x, y] in [[2.7, 0.1], [1.0, 0.8], [-2.0, -0.6]] {
                let z = texton.height_at_mm(dvec2(x, y));
                assert!(z > 0.0 && z < 0.7);
                assert!(texton.side_distance_mm(dvec3(x, y, z)) < 1e-12);
            }
        }
    }
}
