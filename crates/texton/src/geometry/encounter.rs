//! The first bump that a straight scan meets.

use super::scan::ScanAngle;
use super::texture::Texture;

/// A scan from the middle of a bump to the next bump whose base it crosses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encounter {
    /// Which bump: offset in columns and rows.
    pub neighbour: [i64; 2],
    /// Distance from the middle to the point where the scan leaves its own bump, mm.
    pub leaves_mm: f64,
    /// Distance from the middle to the point where the scan enters the other bump, mm.
    pub enters_mm: f64,
    /// Distance from the middle to halfway across the other bump, mm.
    pub middle_mm: f64,
}

impl Encounter {
    /// Length of bare plate between the two, mm.
    #[must_use]
    pub fn gap_mm(&self) -> f64 {
        self.enters_mm - self.leaves_mm
    }
}

/// Rows searched: if none holds a bump on the scan, the scan runs along a gap.
const ROWS: i64 = 64;

/// Columns searched: beyond, double precision cannot distinguish neighbouring columns.
const COLUMNS: f64 = 1e9;

impl Texture {
    /// The first other bump on a scan through the middle of a bump. `None` if the next 64 rows (up to 1e9 columns away)
    /// hold none: the scan then runs (nearly) along a gap of the grid.
    #[must_use]
    pub fn encounter(&self, scan: ScanAngle) -> Option<Encounter> {
        let [a, b] = self.texton().radii().to_array();
        let [pitch_mm, _] = self.layout().pitch_mm();
        // In the scale in which bumps are unit circles.
        let (dx, dy) = (scan.cos() / a, scan.sin() / b);
        let speed = dx.hypot(dy);
        let mut first: Option<Encounter> = None;
        for row in 0..=ROWS {
            let y = self.layout().offset_mm(0, row).y;
            // Columns around the point where the scan crosses the row, wide enough for all bumps that reach the scan.
            let columns: Vec<i64> = if scan.sin() == 0.0 {
                if row > 0 {
                    break;
                }
                vec![1]
            } else {
                let x = y * scan.cos() / scan.sin();
                let near = (x / pitch_mm).floor();
                if near > COLUMNS {
                    break;
                }
                let near = near as i64;
                (near - 1..=near + 2).collect()
            };
            for column in columns.into_iter().filter(|c| (*c, row) != (0, 0)) {
                let offset_mm = self.layout().offset_mm(column, row);
                let (x, y) = (offset_mm.x / a, offset_mm.y / b);
                let along = (x * dx + y * dy) / speed;
                let aside = (x * dy - y * dx) / speed;
                let half = 1.0 - aside * aside;
                if along <= 0.0 || half < 0.0 {
                    continue;
                }
                let half = half.sqrt();
                let met = Encounter {
                    neighbour: [column, row],
                    leaves_mm: 1.0 / speed,
                    enters_mm: (along - half) / speed,
                    middle_mm: along / speed,
                };
                if first.is_none_or(|f| met.enters_mm < f.enters_mm) {
                    first = Some(met);
                }
            }
            // Later rows lie beyond this bump along the scan.
            if first.is_some_and(|f| f.enters_mm * scan.sin() < y) {
                break;
            }
        }
        first
    }
}
