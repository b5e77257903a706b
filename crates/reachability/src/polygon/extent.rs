//! Bounds on the reachable part of a wall.

use crate::error::Result;
use crate::line::{ExactSolver, Interval};
use crate::wall::{WallPlane, WallPoint};
use glam::DVec3;

/// A rectangle of a wall.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Along the wall.
    pub(super) s: Interval,
    pub(super) heights: Interval,
}

/// A rectangle that contains everything reachable, its heights clipped; `None` if that is empty.
pub(super) fn extent(
    solver: &ExactSolver,
    plane: &WallPlane,
    clip: Option<Interval>,
) -> Result<Option<Extent>> {
    let family = solver.family();
    let arm = &family.wide;
    let longest = arm.shoulder_wrist_range().longest_m;
    // Slightly enlarged, to cover rounding of the ends.
    let longest = longest * (1.0 + 1e-13);
    let mut extent: Option<Extent> = None;
    for freedom in &family.freedoms {
        let pose = plane.board_pose(WallPoint::new(0.0, 0.0), freedom.roll)?;
        let wrist = arm.wrist_from_shoulder_m(&pose);
        let across = wrist.dot(plane.normal()).abs();
        if across > longest {
            continue;
        }
        // Bound on the wrist displacement by the roll about the normal; a rise adds directly.
        let lever = wrist - (pose.position_m() - DVec3::Z * arm.geometry().d_bs_m);
        let swing = 2.0 * lever.length() * (0.5 * freedom.half_roll).sin();
        let half = ((longest - across) * (longest + across)).sqrt() + swing;
        let about = |middle: f64, half: f64| Interval::new(middle - half, middle + half);
        let found = Extent {
            s: about(-wrist.dot(plane.along()), half + family.half_width_m),
            heights: about(-wrist.z, half + freedom.half_rise),
        };
        let around =
            |a: Interval, b: Interval| Interval::new(a.lo_m.min(b.lo_m), a.hi_m.max(b.hi_m));
        extent = Some(extent.map_or(found, |e| Extent {
            s: around(e.s, found.s),
            heights: around(e.heights, found.heights),
        }));
    }
    Ok(extent.and_then(|mut extent| {
        let z = &mut extent.heights;
        if let Some(clip) = clip {
            *z = Interval::new(z.lo_m.max(clip.lo_m), z.hi_m.min(clip.hi_m));
        }
        (z.lo_m < z.hi_m).then_some(extent)
    }))
}
