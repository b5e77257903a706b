//! The part of the plate that belongs to one bump of a grid.

use crate::geometry::{Layout, Texton};
use glam::DVec2;

/// A corner of the cell around a bump.
///
/// Corners have integer keys, so that neighbouring cells agree on them to the last bit:
/// `half[i] · pitch / 2 + sign · shift` on each axis, counted from the first bump of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    pub(super) half: [i32; 2],
    pub(super) sign: i8,
}

/// The cells of a grid.
pub(super) struct Cells {
    pitch_mm: [f64; 2],
    shift_mm: [f64; 2],
    /// Corners around a bump, counter-clockwise.
    corners: Vec<Corner>,
    staggered: bool,
}

impl Cells {
    /// A cell is the region closer to its bump than to any other, with bumps scaled to unit circles.
    /// Because bumps do not overlap, each is inside its cell. `None` for a staggered grid whose cells
    /// (nearly) have four corners: their shortest sides vanish.
    pub(super) fn new(texton: &Texton, layout: &Layout) -> Option<Self> {
        let pitch_mm = layout.pitch_mm();
        let (shift_mm, corners): (_, Vec<(i32, i32, i8)>) = match layout {
            Layout::Rectangular { .. } => {
                let corners = vec![(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)];
                ([0.0; 2], corners)
            }
            Layout::Staggered { .. } => {
                // The point equidistant from bumps at (0, 0), (2u, 0) and (u, v), or at (0, 0), (u, v) and (0, 2v).
                let [a, b] = texton.radii().to_array();
                let (u, v) = (0.5 * pitch_mm[0] / a, pitch_mm[1] / b);
                let shift = (v * v - u * u) / 2.0;
                if shift.abs() < 1e-3 * u.min(v).powi(2) {
                    return None;
                }
                // The lower half: upper corners of the row below.
                if shift > 0.0 {
                    let upper = [(1, 0, 1), (0, 2, -1), (-1, 0, 1)];
                    let lower = [(-1, 0, -1), (0, -2, 1), (1, 0, -1)];
                    ([0.0, shift / v * b], [upper, lower].concat())
                } else {
                    let upper = [(1, 0, -1), (0, 2, 1), (0, 2, -1)];
                    let lower = [(-1, 0, 1), (0, -2, -1), (0, -2, 1)];
                    ([-shift / u * a, 0.0], [upper, lower].concat())
                }
            }
        };
        let corner = |(x, y, sign)| Corner { half: [x, y], sign };
        Some(Self {
            pitch_mm,
            shift_mm,
            corners: corners.into_iter().map(corner).collect(),
            staggered: matches!(layout, Layout::Staggered { .. }),
        })
    }

    /// The corners around the bump of a column and row, counter-clockwise.
    pub(super) fn around(&self, column: i32, row: i32) -> impl Iterator<Item = Corner> {
        let moved = i32::from(self.staggered && row.rem_euclid(2) == 1);
        let (x, y) = (2 * column + moved, 2 * row);
        self.corners.iter().map(move |c| Corner {
            half: [c.half[0] + x, c.half[1] + y],
            sign: c.sign,
        })
    }

    /// Position of a corner, from the first bump of the grid, mm.
    pub(super) fn at_mm(&self, corner: Corner) -> DVec2 {
        let along = |i: usize| {
            0.5 * f64::from(corner.half[i]) * self.pitch_mm[i]
                + f64::from(corner.sign) * self.shift_mm[i]
        };
        DVec2::new(along(0), along(1))
    }
}
