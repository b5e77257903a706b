//! Check of a patch against what a printer can make.

use super::patch::Patch;
use crate::geometry::TextonShape;

/// What a printer can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printer {
    /// Smallest gap, height or flat top it can print, mm; 0.05 by default.
    pub least_feature_mm: f64,
    /// Largest tile, mm; 145 x 145 by default.
    pub bed_mm: [f64; 2],
    /// Least plate thickness against bending and breaking, mm; 0.5 by default.
    pub least_plate_mm: f64,
    /// For moulding: steepest sides against the plate that release from the mould, rad; `None` (default) for printing.
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

/// A deviation of the printed patch from its design.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum Finding {
    /// Neighbouring bumps merge.
    #[error("gap between bumps {gap_mm:.4} mm, wanted {least_mm} mm")]
    Gap { gap_mm: f64, least_mm: f64 },
    /// Bumps too low.
    #[error("bumps {height_mm:.4} mm high, wanted {least_mm} mm")]
    Height { height_mm: f64, least_mm: f64 },
    /// A flat top, or a bump, too narrow.
    #[error("bumps {breadth_mm:.4} mm broad at the top, wanted {least_mm} mm")]
    Breadth { breadth_mm: f64, least_mm: f64 },
    /// Sides too steep.
    #[error("sides of {:.1} degrees, allowed {:.1}", steepest_rad.to_degrees(), most_rad.to_degrees())]
    Steepness {
        /// Steepest side, rad; the message states degrees.
        steepest_rad: f64,
        /// rad.
        most_rad: f64,
    },
    /// A plate too thin.
    #[error("plate {plate_mm} mm thick, wanted {least_mm} mm")]
    Plate { plate_mm: f64, least_mm: f64 },
    /// A tile that does not fit the printer, either way round.
    #[error("a tile of {} x {} mm does not fit a printer of {} x {} mm", size_mm[0], size_mm[1], bed_mm[0], bed_mm[1])]
    Tile { size_mm: [f64; 2], bed_mm: [f64; 2] },
    /// Bumps left out because a border would have cut them: the texture has a gap there.
    #[error(
        "bumps left out: {at_border} at the border, {at_tile} between tiles, {at_hole} at holes"
    )]
    LeftOut {
        at_border: usize,
        at_tile: usize,
        at_hole: usize,
    },
}

impl Finding {
    /// Does it prevent printing as designed? Otherwise it is a note.
    #[must_use]
    pub const fn is_fault(&self) -> bool {
        !matches!(self, Self::LeftOut { .. })
    }
}

/// Relative error of the gap as a pitch minus two radii.
const ROUNDING: f64 = 1e-9;

impl Patch {
    /// Deviations from the design on this printer; for the released patch only the bumps left out.
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
