//! A texture: bumps on a grid, and what a finger meets that crosses it.

use crate::surface::closest_on;
use crate::{Layout, ScanAngle, Texton, TextonError};

/// Bumps of one kind on a grid; they may touch, but not overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    texton: Texton,
    layout: Layout,
}

/// Rounding of pitches and radii that touch.
const TOUCHING: f64 = 1e-12;

impl Texture {
    /// A texture.
    ///
    /// # Errors
    /// A pitch that is no positive number; bumps that overlap.
    pub fn new(texton: Texton, layout: Layout) -> Result<Self, TextonError> {
        layout.validate()?;
        let texture = Self { texton, layout };
        let (distance, [columns, rows]) = texture.closest();
        if distance < 2.0 - TOUCHING {
            return Err(TextonError::Overlap {
                columns,
                rows,
                distance,
            });
        }
        Ok(texture)
    }

    /// The bump.
    #[must_use]
    pub const fn texton(&self) -> &Texton {
        &self.texton
    }

    /// The grid.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Share of the plate that bumps cover.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        self.texton.base_area_mm2() / self.layout.cell_area_mm2()
    }

    /// Width of the plate left free between neighbouring bumps where they are closest, mm.
    ///
    /// Twice the distance of the place halfway between two middles from either ellipse, which are
    /// mirror images of each other; zero for bumps that touch.
    #[must_use]
    pub fn gap_mm(&self) -> f64 {
        let radii = self.texton.radii_mm();
        let gap_mm = neighbours()
            .filter_map(|[columns, rows]| {
                let half = self.layout.offset_mm(columns, rows).map(|x| 0.5 * x);
                let inside = (half[0] / radii[0]).hypot(half[1] / radii[1]) <= 1.0 + TOUCHING;
                if inside {
                    return Some(0.0);
                }
                let closest = closest_on(radii, half)?;
                Some(2.0 * (closest[0] - half[0]).hypot(closest[1] - half[1]))
            })
            .fold(f64::INFINITY, f64::min);
        gap_mm.max(0.0)
    }

    /// Smallest angle at which a scan meets the next row on the ridge of its bump, rad:
    /// `atan(p_short / r_x)`, in a staggered grid `atan(p_short / (r_x + p_long / 2))`.
    ///
    /// A rectangular grid's next row is met from there on. A staggered grid's is passed again where
    /// `p_short / tan θ < p_long / 2 - r_x`.
    #[must_use]
    pub fn least_spaced_rad(&self) -> f64 {
        let [_, short_mm] = self.layout.pitch_mm();
        let [moved_mm, _] = self.layout.offset_mm(0, 1);
        short_mm.atan2(self.texton.radii_mm()[0] + moved_mm)
    }

    /// `d(θ)`: distance from the top of a bump to the ridge of the next one along the scan, mm.
    ///
    /// The next row's, `p_short / sin θ`, from [`Texture::least_spaced_rad`] on; `p_long` along the
    /// long axis; `None` between, where the scan passes the ends of the bumps (the dissertation
    /// uses no such angle). In a staggered grid the next row's where its shifted bump is met, else
    /// `2 p_short / sin θ` where the row after is met, else `None`.
    #[must_use]
    pub fn spacing_mm(&self, scan: ScanAngle) -> Option<f64> {
        let [long_mm, short_mm] = self.layout.pitch_mm();
        if scan.sin() == 0.0 {
            return Some(long_mm);
        }
        let half_mm = self.texton.radii_mm()[0];
        [1_i64, 2].into_iter().find_map(|row| {
            let [at_mm, _] = self.layout.offset_mm(0, row);
            let way_mm = row as f64 * short_mm / scan.sin();
            let beside_mm = (way_mm * scan.cos() - at_mm).abs();
            // Rounded so that the least angle itself counts.
            let met = beside_mm <= half_mm * (1.0 + TOUCHING);
            (met && (row == 1 || at_mm == 0.0 && self.is_staggered())).then_some(way_mm)
        })
    }

    /// Mean distance between the bumps that a finger's centre line meets, over all parallel lines,
    /// mm: `p_long p_short / (2 √(r_x² sin² θ + r_y² cos² θ))`.
    #[must_use]
    pub fn mean_encounter_mm(&self, scan: ScanAngle) -> f64 {
        self.layout.cell_area_mm2() / self.texton.breadth_mm(scan)
    }

    /// Bumps a second at a speed, `v / d`, Hz, by [`Texture::spacing_mm`].
    #[must_use]
    pub fn ridge_frequency_hz(&self, scan: ScanAngle, speed_mm_per_s: f64) -> Option<f64> {
        Some(speed_mm_per_s / self.spacing_mm(scan)?)
    }

    /// Bumps a second at a speed, Hz, by [`Texture::mean_encounter_mm`].
    #[must_use]
    pub fn encounter_frequency_hz(&self, scan: ScanAngle, speed_mm_per_s: f64) -> f64 {
        speed_mm_per_s / self.mean_encounter_mm(scan)
    }

    const fn is_staggered(&self) -> bool {
        matches!(self.layout, Layout::Staggered { .. })
    }

    /// The closest pair of bumps, in the scale in which they are unit circles.
    fn closest(&self) -> (f64, [i64; 2]) {
        let [long_mm, short_mm] = self.texton.radii_mm();
        let apart = |[columns, rows]: [i64; 2]| {
            let [x, y] = self.layout.offset_mm(columns, rows);
            (x / long_mm).hypot(y / short_mm)
        };
        neighbours()
            .map(|n| (apart(n), n))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, [0, 0]))
    }
}

/// The bumps around one, up to reflection.
fn neighbours() -> impl Iterator<Item = [i64; 2]> {
    [[1, 0], [0, 1], [-1, 1], [1, 1], [0, 2]].into_iter()
}
