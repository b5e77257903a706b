//! What the tests of simulated people share.

use glam::DVec3;
use hwall_sim::{TouchPlan, TouchTruth};
use hwall_testkit::Sampler;

/// Touches of slanted walls in a box, m; one in four of a shelf top where there are `shelves`.
pub(crate) fn touches_in(
    [low_m, high_m]: [DVec3; 2],
    shelves: bool,
    seed: u64,
    count: usize,
) -> Vec<TouchPlan> {
    let mut sampler = Sampler::new(seed);
    let one = |_| {
        let target_m = sampler.point_in_box(low_m, high_m);
        let tilt = sampler.point_in_box(DVec3::splat(-0.2), DVec3::splat(0.2));
        let normal = if shelves && sampler.index(4) == 0 {
            DVec3::Z
        } else {
            DVec3::X + tilt
        };
        TouchPlan { target_m, normal }
    };
    (0..count).map(one).collect()
}

/// How far a point is before the surface that is touched, m.
pub(crate) fn height(touch: &TouchTruth, point_m: DVec3) -> f64 {
    (point_m - touch.target_m).dot(touch.normal)
}
