//! A level: an orientation and a speed that present a roughness. A table of levels.

use crate::error::{Result, TextonError};
use crate::geometry::ScanAngle;
use hwall_numeric::check::{finite, non_negative};

/// An orientation and a speed, and how rough they feel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Angle between scan and long axis of the bumps.
    pub scan: ScanAngle,
    /// Speed of the board against the scan, mm/s.
    pub speed_mm_per_s: f64,
    /// Magnitude, in the scale of the study or the model.
    pub magnitude: f64,
}

/// Levels sorted by magnitude, for lookups in a control loop.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelTable {
    levels: Vec<Level>,
    /// Magnitudes halfway between neighbours, where the nearest level changes.
    borders: Vec<f64>,
}

impl LevelTable {
    /// From levels in any order; levels of equal magnitude keep their order.
    ///
    /// # Errors
    /// No level, a magnitude that is not finite, or a speed that is negative or not finite.
    pub fn new(mut levels: Vec<Level>) -> Result<Self> {
        if levels.is_empty() {
            return Err(TextonError::TooFewLevels {
                wanted: 1,
                levels: 0,
            });
        }
        for level in &levels {
            finite("magnitude", level.magnitude)?;
            non_negative("speed_mm_per_s", level.speed_mm_per_s)?;
        }
        levels.sort_by(|a, b| a.magnitude.total_cmp(&b.magnitude));
        let middle = |w: &[Level]| 0.5 * w[0].magnitude + 0.5 * w[1].magnitude;
        let borders = levels.windows(2).map(middle).collect();
        Ok(Self { levels, borders })
    }

    /// The levels, from the smoothest.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The level with the nearest magnitude; ties give the smoother one; `None` for NaN.
    #[must_use]
    pub fn nearest(&self, magnitude: f64) -> Option<&Level> {
        if magnitude.is_nan() {
            return None;
        }
        let index = self.borders.partition_point(|border| *border < magnitude);
        self.levels.get(index)
    }
}
