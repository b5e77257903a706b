//! The part of the plate that belongs to one bump of a grid.

use crate::geometry::{Layout, Texton};
use glam::DVec2;

/// A corner of the cell around a bump.
///
/// Corners are named by whole numbers, so that neighbouring cells agree on them to the last bit: at
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
    /// Each cell is what is closer to its bump than to any other after bumps are scaled to unit circles: as
    /// these do not overlap, each is inside its cell. `None` for a staggered grid whose cells (nearly) have
    /// four corners, as their shortest sides vanish.
    pub(super) fn new(texton: &Texton, layout: &Layout) -> Option<Self> {
        let pitch_mm = layout.pitch_mm();
        let corner = |x: i32, y: i32, sign: i8| Corner { half: [x, y], sign };
        if let Layout::Rectangular { .. } = layout {
            return Some(Self {
                pitch_mm,
                shift_mm: [0.0; 2],
                corners: vec![
                    corner(-1, -1, 0),
                    corner(1, -1, 0),
                    corner(1, 1, 0),
                    corner(-1, 1, 0),
                ],
                staggered: false,
            });
        }
        // Between bumps at (0, 0), (2u, 0) and (u, v), or at (0, 0), (u, v) and (0, 2v): the place that is
        // equally far from all three.
        let [a, b] = texton.radii().to_array();
        let (u, v) = (0.5 * pitch_mm[0] / a, pitch_mm[1] / b);
        let shift = (v * v - u * u) / 2.0;
        if shift.abs() < 1e-3 * u.min(v).powi(2) {
            return None;
        }
        let (shift_mm, corners) = if shift > 0.0 {
            (
                [0.0, shift / v * b],
                vec![
                    corner(1, 0, 1),
                    corner(0, 2, -1),
                    corner(-1, 0, 1),
                    // Below: the upper corners of the row beneath.
                    corner(-1, 0, -1),
                    corner(0, -2, 1),
                    corner(1, 0, -1),
                ],
            )
        } else {
            (
                [-shift / u * a, 0.0],
                vec![
                    corner(1, 0, -1),
                    corner(0, 2, 1),
                    corner(0, 2, -1),
                    corner(-1, 0, 1),
                    corner(0, -2, -1),
                    corner(0, -2, 1),
                ],
            )
        };
        Some(Self {
            pitch_mm,
            shift_mm,
            corners,
            staggered: true,
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

    /// Where a corner is, from the first bump of the grid, mm.
    pub(super) fn at_mm(&self, corner: Corner) -> DVec2 {
        let along = |i: usize| {
            0.5 * f64::from(corner.half[i]) * self.pitch_mm[i]
                + f64::from(corner.sign) * self.shift_mm[i]
        };
        DVec2::new(along(0), along(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Radii;
    use std::collections::HashMap;

    #[test]
    fn cells_of_every_grid_fit_together_around_their_bumps() {
        let radii = Radii {
            long_mm: 3.0,
            short_mm: 1.0,
        };
        let texton = Texton::hemiellipsoid(radii, 0.7).unwrap();
        let staggered = |long_mm, short_mm| Layout::Staggered { long_mm, short_mm };
        for layout in [
            Layout::Rectangular {
                long_mm: 6.2,
                short_mm: 2.2,
            },
            staggered(6.2, 1.8),
            staggered(12.0, 1.2),
        ] {
            let cells = Cells::new(&texton, &layout).unwrap();
            let mut edges: HashMap<(Corner, Corner), i32> = HashMap::new();
            for row in 0..4 {
                for column in 0..4 {
                    let corners: Vec<Corner> = cells.around(column, row).collect();
                    let at: Vec<DVec2> = corners.iter().map(|c| cells.at_mm(*c)).collect();
                    let middle = layout.offset_mm(i64::from(column), i64::from(row));
                    let mut area = 0.0;
                    for i in 0..at.len() {
                        let (p, q) = (at[i], at[(i + 1) % at.len()]);
                        area += 0.5 * p.perp_dot(q);
                        let (px, py) = ((p.x - middle.x) / 3.0, p.y - middle.y);
                        let (dx, dy) = ((q.x - p.x) / 3.0, q.y - p.y);
                        // The unit circle lies left of every side.
                        assert!((px * dy - py * dx) / dx.hypot(dy) >= 1.0 - 1e-12);
                        let next = corners[(i + 1) % corners.len()];
                        *edges.entry((corners[i], next)).or_default() += 1;
                        *edges.entry((next, corners[i])).or_default() -= 1;
                    }
                    assert!((area - layout.cell_area_mm2()).abs() < 1e-9);
                }
            }
            // Sides between cells cancel: what is left is the outline of the block.
            let open = edges.values().filter(|n| **n == 1).count();
            let sides = cells.corners.len() / 2;
            assert!(open <= 16 * sides && open >= 16, "{open}");
            assert!(edges.values().all(|n| n.abs() <= 1));
        }
        assert!(Cells::new(&texton, &staggered(6.2, 6.2 / 6.0)).is_none());
    }
}
