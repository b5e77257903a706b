//! Check of a patch against what a printer can make.

use super::patch::Patch;
use crate::geometry::TextonShape;

/// What a printer can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printer {
    /// Smallest gap, height or flat top that comes out, mm; 0.05 by default.
    pub least_feature_mm: f64,
    /// Largest tile, mm; 145 x 145 by default.
    pub bed_mm: [f64; 2],
    /// Thinnest plate that does not bend or break, mm; 0.5 by default.
    pub least_plate_mm: f64,
    /// Steepest sides against the plate, rad, that come out of a mould; `None` by default, for printing.
    pub steepest_rad: Option<f64>,
}

impl Default for Printer {
    fn default() -> Self {
        Self {
            least_feature_mm: 0.05,
            bed_mm: [145.0, 145.0],
            least_plate_mm: 0.5,
            steepest_rad: None,
        }
    }
}

/// Something that will not come out as designed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// Neighbouring bumps merge.
    Gap {
        /// Between the bumps, mm.
        gap_mm: f64,
        /// Wanted, mm.
        least_mm: f64,
    },
    /// Bumps too low.
    Height {
        /// Of the bumps, mm.
        height_mm: f64,
        /// Wanted, mm.
        least_mm: f64,
    },
    /// A flat top, or a bump, too narrow.
    Breadth {
        /// Across the short axis, mm.
        breadth_mm: f64,
        /// Wanted, mm.
        least_mm: f64,
    },
    /// Sides too steep.
    Steepness {
        /// Against the plate, rad.
        steepest_rad: f64,
        /// Allowed, rad.
        most_rad: f64,
    },
    /// A plate too thin.
    Plate {
        /// Its thickness, mm.
        plate_mm: f64,
        /// Wanted, mm.
        least_mm: f64,
    },
    /// A tile that does not fit the printer, either way round.
    Tile {
        /// Its size, mm.
        size_mm: [f64; 2],
        /// The printer's, mm.
        bed_mm: [f64; 2],
    },
    /// Bumps left out where a border would have cut them: the texture has a gap there.
    LeftOut {
        /// At the border of the plate.
        at_border: usize,
        /// At borders between tiles.
        at_tile: usize,
        /// At mounting holes.
        at_hole: usize,
    },
}

impl Finding {
    /// Does it keep the patch from being printed as designed? Otherwise it is a note.
    #[must_use]
    pub const fn is_fault(&self) -> bool {
        !matches!(self, Self::LeftOut { .. })
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Gap { gap_mm, least_mm } => {
                write!(f, "gap between bumps {gap_mm:.4} mm, wanted {least_mm} mm")
            }
            Self::Height {
                height_mm,
                least_mm,
            } => write!(f, "bumps {height_mm:.4} mm high, wanted {least_mm} mm"),
            Self::Breadth {
                breadth_mm,
                least_mm,
            } => write!(
                f,
                "bumps {breadth_mm:.4} mm broad at the top, wanted {least_mm} mm"
            ),
            Self::Steepness {
                steepest_rad,
                most_rad,
            } => write!(
                f,
                "sides of {:.1} degrees, allowed {:.1}",
                steepest_rad.to_degrees(),
                most_rad.to_degrees()
            ),
            Self::Plate { plate_mm, least_mm } => {
                write!(f, "plate {plate_mm} mm thick, wanted {least_mm} mm")
            }
            Self::Tile {
                size_mm: [x, y],
                bed_mm: [w, l],
            } => write!(
                f,
                "a tile of {x} x {y} mm does not fit a printer of {w} x {l} mm"
            ),
            Self::LeftOut {
                at_border,
                at_tile,
                at_hole,
            } => write!(
                f,
                "bumps left out: {at_border} at the border, {at_tile} between tiles, {at_hole} at holes"
            ),
        }
    }
}

/// Relative error of the gap as a pitch minus two radii.
const ROUNDING: f64 = 1e-9;

impl Patch {
    /// What will not come out as designed on a printer; for the released patch only the bumps left out.
    ///
    /// Overlapping bumps do not occur: [`Texture::new`](crate::geometry::Texture::new) refuses them.
    #[must_use]
    pub fn print_check(&self, printer: &Printer) -> Vec<Finding> {
        let texton = self.texture().texton();
        let least_mm = printer.least_feature_mm;
        let mut findings = Vec::new();
        let gap_mm = self.texture().gap_mm();
        if self.counts().placed > 1 && gap_mm < least_mm * (1.0 - ROUNDING) {
            findings.push(Finding::Gap { gap_mm, least_mm });
        }
        let height_mm = texton.height_mm();
        if height_mm < least_mm {
            findings.push(Finding::Height {
                height_mm,
                least_mm,
            });
        }
        let breadth_mm = 2.0
            * match texton.shape() {
                TextonShape::Hemiellipsoid => texton.radii().short_mm,
                TextonShape::TruncatedCone { .. } => texton.top_radii().short_mm,
            };
        if breadth_mm < least_mm {
            findings.push(Finding::Breadth {
                breadth_mm,
                least_mm,
            });
        }
        let steepest_rad = texton.steepest_rad();
        if let Some(most_rad) = printer.steepest_rad.filter(|most| steepest_rad > *most) {
            findings.push(Finding::Steepness {
                steepest_rad,
                most_rad,
            });
        }
        let plate_mm = self.spec().plate_mm;
        if plate_mm < printer.least_plate_mm {
            findings.push(Finding::Plate {
                plate_mm,
                least_mm: printer.least_plate_mm,
            });
        }
        let [w, l] = printer.bed_mm;
        let too_large = self
            .rectangles()
            .iter()
            .map(|t| (t.high - t.low).to_array())
            .find(|[x, y]| !(*x <= w && *y <= l || *x <= l && *y <= w));
        if let Some(size_mm) = too_large {
            findings.push(Finding::Tile {
                size_mm,
                bed_mm: printer.bed_mm,
            });
        }
        let counts = self.counts();
        if counts.at_border + counts.at_tile + counts.at_hole > 0 {
            findings.push(Finding::LeftOut {
                at_border: counts.at_border,
                at_tile: counts.at_tile,
                at_hole: counts.at_hole,
            });
        }
        findings
    }
}
