//! Reachability on a wall does not depend on the heading, the handedness of the world, the unit of length or the order of walls.

use crate::common::{exact_solver, line, scaled_iiwa, wall, with_limit};
use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    ExactSolver, LineReachability, Presented, WallFacet, WallMaps, WallMapsConfig, WallPlane,
};
use hwall_testkit::Sampler;

const ACCURACY_M: f64 = 1e-6;

/// An iiwa `size` times as large, with a board.
fn arm(size: f64) -> SrsArm {
    let tool = Pose::from_translation(DVec3::Z * 0.1 * size).expect("finite");
    scaled_iiwa(size).with_tool(tool)
}

/// Heading in degrees, distance and height of a line, m.
fn drawn(sampler: &mut Sampler) -> [f64; 3] {
    [
        sampler.uniform(-180.0, 180.0),
        sampler.uniform(-0.9, 0.9),
        sampler.uniform(-0.3, 1.3),
    ]
}

/// Both lines have the same stretches, after mapping positions of the second line.
fn same(a: &LineReachability, b: &LineReachability, place: impl Fn(f64) -> f64, size: f64) {
    let ends = |reach: &LineReachability, place: &dyn Fn(f64) -> f64| {
        let spans = reach.intervals.iter().map(|i| i.span);
        // Points barely reached may differ within the accuracy.
        let long = spans.filter(|span| span.length_m() > 1e-3);
        let mut ends: Vec<f64> = long.flat_map(|s| [place(s.lo_m), place(s.hi_m)]).collect();
        ends.sort_by(f64::total_cmp);
        ends
    };
    let (a, b) = (ends(a, &place), ends(b, &|s| s / size));
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 4.0 * ACCURACY_M, "{a} {b}");
    }
}

#[test]
fn lines_may_be_turned_mirrored_and_measured_otherwise() {
    let size = 40.0;
    let exact = |arm: &SrsArm, size: f64| exact_solver(arm, |c| c.accuracy_m = size * ACCURACY_M);
    let endless = with_limit(&arm(1.0), 0, [f64::NEG_INFINITY, f64::INFINITY]);
    let (nominal, turning) = (exact(&arm(1.0), 1.0), exact(&endless, 1.0));
    let large = exact(&arm(size), size);
    let mut sampler = Sampler::new(8);
    let mut reached = 0;
    for _ in 0..300 {
        let [heading_deg, distance_m, height_m] = drawn(&mut sampler);
        let of = |solver: &ExactSolver, heading_deg: f64, size: f64| {
            let line = line(heading_deg, size * distance_m, size * height_m);
            solver.line(&line).expect("solved")
        };
        let here = of(&nominal, heading_deg, 1.0);
        reached += usize::from(!here.intervals.is_empty());
        same(&here, &of(&nominal, -heading_deg, 1.0), |s| -s, 1.0);
        same(&here, &of(&large, heading_deg, size), |s| s, size);
        let turn_deg = sampler.uniform(-180.0, 180.0);
        let there = of(&turning, heading_deg + turn_deg, 1.0);
        same(&of(&turning, heading_deg, 1.0), &there, |s| s, 1.0);
    }
    assert!(reached > 100, "{reached}");
}

#[test]
fn walls_come_in_any_order() {
    let facets = [wall(0.0, 0.7), wall(1.4, 0.6), wall(-0.9, 0.5)];
    let maps = |facets: &[WallFacet]| {
        WallMaps::build(&arm(1.0), facets, WallMapsConfig::default()).expect("built")
    };
    let mut others = facets.to_vec();
    others.reverse();
    let (here, there) = (maps(&facets), maps(&others));
    let mut sampler = Sampler::new(9);
    let mut instead = 0;
    for _ in 0..600 {
        let facet = &facets[sampler.index(3)];
        let plane = WallPlane::through(facet.point_m, facet.normal).expect("a wall");
        let [s_m, z_m] = [sampler.uniform(-1.4, 1.4), sampler.uniform(0.0, 1.36)];
        let point_m = facet.point_m + plane.along() * s_m + DVec3::Z * z_m;
        let found = here.present(point_m, facet.normal);
        instead += usize::from(matches!(found, Presented::Nearest(_)));
        assert_eq!(found, there.present(point_m, facet.normal), "{point_m}");
    }
    assert!(instead > 50, "{instead}");
}
