//! Contact targets of the arm.

use super::size_limits::{MOST_BOARDS, refuse_above};
use crate::error::Result;
use crate::line::Interval;
use crate::wall::WallPlane;
use glam::DVec3;
use hwall_numeric::check::{finite, non_negative, positive};

/// A required board placement on a wall: its middle and the wall's normal, room frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The board's middle (the tool point), m; z is up.
    pub point_m: DVec3,
    /// Normal of the wall towards the person, horizontal (a tilt up to 1 degree is ignored), of any length but zero.
    pub normal: DVec3,
}

impl Target {
    /// Targets on a rectangle of a wall, row by row, borders included, evenly spaced and at most `spacing_m` apart.
    ///
    /// `middle_m` is halfway along the wall (its z is not used), `normal` points towards the
    /// person, `heights` are those of the lower and upper border; room frame. A width or height
    /// of zero gives a single column or row.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is not horizontal, a negative width, a spacing that is not
    /// positive, or too many targets.
    pub fn on_wall(
        middle_m: DVec3,
        normal: DVec3,
        width_m: f64,
        heights: Interval,
        spacing_m: f64,
    ) -> Result<Vec<Self>> {
        let plane = WallPlane::through(middle_m, normal)?;
        non_negative("width_m", width_m)?;
        positive("spacing_m", spacing_m)?;
        let (low, high) = (heights.lo_m, heights.hi_m);
        let height = finite("upper border", high)? - finite("lower border", low)?;
        let intervals = |extent: f64| {
            // An interval that is too long only by rounding is not divided.
            finite("extent in steps", extent.abs() / spacing_m).map(|n| (n - 1e-9).ceil().max(0.0))
        };
        let (across, up) = (intervals(width_m)?, intervals(height)?);
        let lines = |n: f64| (n as u128).saturating_add(1);
        let count = lines(across).saturating_mul(lines(up));
        refuse_above(MOST_BOARDS, "targets", count)?;
        // From the middle, -1/2 to 1/2; a single one in the middle.
        let share = |i: u32, n: f64| if n > 0.0 { f64::from(i) / n - 0.5 } else { 0.0 };
        let mut targets = Vec::with_capacity(count as usize);
        for row in 0..=up as u32 {
            let z = 0.5 * (low + high) + height * share(row, up);
            for column in 0..=across as u32 {
                let side = plane.along() * (width_m * share(column, across));
                targets.push(Self {
                    point_m: DVec3::new(middle_m.x + side.x, middle_m.y + side.y, z),
                    normal: plane.normal(),
                });
            }
        }
        Ok(targets)
    }
}
