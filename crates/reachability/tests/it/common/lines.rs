//! Lines against the verdicts of single poses.

use hwall_kinematics::Pose;
use hwall_reachability::{Interval, LineReachability, WallLine};
use hwall_testkit::Sampler;

/// Test positions: anywhere, and close to every end and band.
pub(crate) fn places(
    reach: &LineReachability,
    size: f64,
    sampler: &mut Sampler,
    count: usize,
) -> Vec<f64> {
    let spans = reach.intervals.iter().map(|i| &i.span);
    let spans = reach.unknown.iter().chain(spans);
    let ends: Vec<f64> = spans.flat_map(|i| [i.lo_m, i.hi_m]).collect();
    (0..count)
        .map(|_| {
            if ends.is_empty() || sampler.bool() {
                sampler.uniform(-1.2 * size, 1.2 * size)
            } else {
                let near = size * 10.0_f64.powf(sampler.uniform(-10.0, -1.0));
                ends[sampler.index(ends.len())] + sampler.uniform(-near, near)
            }
        })
        .collect()
}

/// Compares a line with the verdict at many positions.
pub(crate) fn check_line(
    line: &WallLine,
    reach: &LineReachability,
    size: f64,
    sampler: &mut Sampler,
    count: usize,
    verdict: impl Fn(&Pose) -> bool,
) {
    let sorted = |spans: &[Interval]| spans.windows(2).all(|w| w[0].hi_m < w[1].lo_m);
    let spans: Vec<Interval> = reach.intervals.iter().map(|i| i.span).collect();
    assert!(
        sorted(&spans) && sorted(&reach.unknown),
        "{line:?} {reach:?}"
    );
    for s in places(reach, size, sampler, count) {
        if reach.is_proven(s) {
            let pose = line.board_pose(s, 0.0).expect("finite");
            let found = reach.contains(s);
            assert_eq!(found, verdict(&pose), "{line:?} at {s}: {reach:?}");
        }
    }
}
