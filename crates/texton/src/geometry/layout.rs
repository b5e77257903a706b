//! How bumps stand on a plate.

use glam::DVec2;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::positive;

/// A grid of bumps: rows run along the long axis (x) and follow each other along the short axis (y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Layout {
    /// Bumps straight above each other.
    Rectangular {
        /// Pitch along the long axis, mm.
        long_mm: f64,
        /// Pitch along the short axis, mm.
        short_mm: f64,
    },
    /// Every second row shifted by half the long pitch.
    Staggered {
        /// Pitch along the long axis, mm.
        long_mm: f64,
        /// Distance of neighbouring rows, mm.
        short_mm: f64,
    },
}

impl Layout {
    /// Pitch along the long axis and distance of the rows, mm.
    #[must_use]
    pub const fn pitch_mm(&self) -> [f64; 2] {
        match *self {
            Self::Rectangular { long_mm, short_mm } | Self::Staggered { long_mm, short_mm } => {
                [long_mm, short_mm]
            }
        }
    }

    /// Position of the bump in a column and row, relative to column 0 and row 0, mm.
    #[must_use]
    pub fn offset_mm(&self, column: i64, row: i64) -> DVec2 {
        let [long_mm, short_mm] = self.pitch_mm();
        let moved = match self {
            Self::Staggered { .. } if row.rem_euclid(2) == 1 => 0.5,
            _ => 0.0,
        };
        DVec2::new((column as f64 + moved) * long_mm, row as f64 * short_mm)
    }

    /// Area of the plate for each bump, mm².
    #[must_use]
    pub fn cell_area_mm2(&self) -> f64 {
        let [long_mm, short_mm] = self.pitch_mm();
        long_mm * short_mm
    }

    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        let [long_mm, short_mm] = self.pitch_mm();
        positive("long pitch, mm", long_mm)?;
        positive("short pitch, mm", short_mm)?;
        Ok(())
    }
}
