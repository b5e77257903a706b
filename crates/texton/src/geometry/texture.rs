//! A texture: bumps on a grid, and the bumps a finger meets when it crosses them.

use super::closest::closest_on;
use super::layout::Layout;
use super::scan::ScanAngle;
use super::texton::{Radii, Texton};
use crate::error::{Result, TextonError};

/// Bumps of one kind on a grid; they may touch, but not overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    texton: Texton,
    layout: Layout,
}

/// Relative rounding tolerance of pitches and radii of touching bumps.
const TOUCHING: f64 = 1e-12;

impl Texture {
    /// Bumps of this kind on this grid.
    ///
    /// # Errors
    /// A pitch that is not positive; bumps that overlap.
    pub fn new(texton: Texton, layout: Layout) -> Result<Self> {
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

    /// The texture of the released patch: radii 3 and 1 mm, pitch 6.2 x 2.2 mm.
    ///
    /// The dissertation's text asks for a short radius of 1.5 mm so that spacings stay above 3 mm;
    /// its studies and its released patch use 1 mm and a short pitch of 2.2 mm.
    #[must_use]
    pub fn released() -> Self {
        preset(3.0, rectangular(6.2, 2.2))
    }

    /// The texture that the dissertation's text describes, with spacings of 3 mm and above: pitch 7 x 3 mm.
    #[must_use]
    pub fn spaced_3_mm() -> Self {
        preset(3.0, rectangular(7.0, 3.0))
    }

    /// Patch of the preliminary study with a long radius of 1.5 mm: pitch 3.5 x 3.5 mm.
    #[must_use]
    pub fn study_1_5() -> Self {
        preset(1.5, rectangular(3.5, 3.5))
    }

    /// Patch of the preliminary study with a long radius of 2 mm: pitch 4.5 x 2.25 mm.
    #[must_use]
    pub fn study_2() -> Self {
        preset(2.0, rectangular(4.5, 2.25))
    }

    /// Patch of the preliminary study with a long radius of 2.5 mm: pitch 5.5 x 2.75 mm.
    #[must_use]
    pub fn study_2_5() -> Self {
        preset(2.5, rectangular(5.5, 2.75))
    }

    /// Patch of the preliminary study with a long radius of 3 mm: pitch 6.5 x 13/6 mm.
    #[must_use]
    pub fn study_3() -> Self {
        preset(3.0, rectangular(6.5, 6.5 / 3.0))
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

    /// Smallest gap of bare plate between neighbouring bumps, mm.
    ///
    /// Twice the distance from the point halfway between two middles to either ellipse, because the two are
    /// mirror images of each other; zero for bumps that touch.
    #[must_use]
    pub fn gap_mm(&self) -> f64 {
        let radii = self.texton.radii().to_array();
        let gap_mm = neighbours()
            .filter_map(|[columns, rows]| {
                let half = 0.5 * self.layout.offset_mm(columns, rows);
                let inside = (half.x / radii[0]).hypot(half.y / radii[1]) <= 1.0 + TOUCHING;
                if inside {
                    return Some(0.0);
                }
                let closest = closest_on(radii, half.to_array())?;
                Some(2.0 * (closest[0] - half.x).hypot(closest[1] - half.y))
            })
            .fold(f64::INFINITY, f64::min);
        gap_mm.max(0.0)
    }

    /// Smallest angle at which a scan from the middle of a bump meets the ridge of a bump in the next row, rad:
    /// `atan(p_short / r_x)`, in a staggered grid `atan(p_short / (r_x + p_long / 2))`.
    ///
    /// In a rectangular grid, scans at all larger angles meet that bump too. In a staggered grid the scan
    /// misses the bump on the other side if `p_short / tan θ < p_long / 2 - r_x`.
    #[must_use]
    pub fn least_spaced_rad(&self) -> f64 {
        let [_, short_mm] = self.layout.pitch_mm();
        let moved_mm = self.layout.offset_mm(0, 1).x;
        short_mm.atan2(self.texton.radii().long_mm + moved_mm)
    }

    /// `d(θ)`: distance from the top of a bump to the ridge of the next one along the scan, mm.
    ///
    /// From [`Texture::least_spaced_rad`] on it is `p_short / sin θ`, to the next row; along the long axis it is `p_long`.
    /// Between these angles it is `None`, because the scan passes the ends of the bumps (the dissertation uses no such
    /// angle). In a staggered grid it is `p_short / sin θ` if the scan meets the shifted bump of the next row, `2 p_short /
    /// sin θ` if it only meets the row after that, and otherwise `None`.
    #[must_use]
    pub fn spacing_mm(&self, scan: ScanAngle) -> Option<f64> {
        let [long_mm, short_mm] = self.layout.pitch_mm();
        if scan.sin() == 0.0 {
            return Some(long_mm);
        }
        let half_mm = self.texton.radii().long_mm;
        [1_i64, 2].into_iter().find_map(|row| {
            let at_mm = self.layout.offset_mm(0, row).x;
            let way_mm = row as f64 * short_mm / scan.sin();
            let beside_mm = (way_mm * scan.cos() - at_mm).abs();
            // With a tolerance, so that the least angle itself counts.
            let met = beside_mm <= half_mm * (1.0 + TOUCHING);
            (met && (row == 1 || at_mm == 0.0 && self.is_staggered())).then_some(way_mm)
        })
    }

    /// Mean distance between the bumps that the centre line of a finger meets, over all parallel lines,
    /// mm: `p_long p_short / (2 √(r_x² sin² θ + r_y² cos² θ))`.
    #[must_use]
    pub fn mean_encounter_mm(&self, scan: ScanAngle) -> f64 {
        self.layout.cell_area_mm2() / self.texton.breadth_mm(scan)
    }

    /// Bumps per second at a speed, `v / d`, Hz, by [`Texture::spacing_mm`].
    #[must_use]
    pub fn ridge_frequency_hz(&self, scan: ScanAngle, speed_mm_per_s: f64) -> Option<f64> {
        Some(speed_mm_per_s / self.spacing_mm(scan)?)
    }

    /// Bumps per second at a speed, Hz, by [`Texture::mean_encounter_mm`].
    #[must_use]
    pub fn encounter_frequency_hz(&self, scan: ScanAngle, speed_mm_per_s: f64) -> f64 {
        speed_mm_per_s / self.mean_encounter_mm(scan)
    }

    const fn is_staggered(&self) -> bool {
        matches!(self.layout, Layout::Staggered { .. })
    }

    /// The closest pair of bumps, scaled to unit circles.
    fn closest(&self) -> (f64, [i64; 2]) {
        let Radii { long_mm, short_mm } = self.texton.radii();
        let apart = |[columns, rows]: [i64; 2]| {
            let apart = self.layout.offset_mm(columns, rows);
            (apart.x / long_mm).hypot(apart.y / short_mm)
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

/// Short radius of the bumps of every preset, mm.
const SHORT_MM: f64 = 1.0;

/// Height of the bumps of every preset, mm.
const HEIGHT_MM: f64 = 0.7;

const fn rectangular(long_mm: f64, short_mm: f64) -> Layout {
    Layout::Rectangular { long_mm, short_mm }
}

/// Hemiellipsoids of this long radius.
fn preset(long_mm: f64, layout: Layout) -> Texture {
    let radii = Radii {
        long_mm,
        short_mm: SHORT_MM,
    };
    Texton::hemiellipsoid(radii, HEIGHT_MM)
        .and_then(|texton| Texture::new(texton, layout))
        .expect("the bumps of the presets are apart")
}
