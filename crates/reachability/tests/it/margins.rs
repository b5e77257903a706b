//! Margins of poses, and reasons why points of a wall are unreachable.

use glam::{DMat3, DVec3};
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    ExactConfig, ExactSolver, Interval, ReachabilityError, ReachabilityReasons, WallPlane,
    orientation_margin_rad, position_margin_m,
};
use hwall_testkit::Sampler;

const SEED: u64 = 5;

#[test]
fn margins_are_proven() {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let facing = WallPlane::new(0.0, 0.0)
        .expect("finite")
        .board_rotation(0.0);
    let (mut some, mut none) = (0, 0);
    for _ in 0..600 {
        let at = sampler.point_in_box(DVec3::new(-0.4, -0.9, -0.3), DVec3::new(0.95, 0.9, 1.3));
        let pose = Pose::new(facing, at).expect("finite");
        let radius = position_margin_m(&arm, &pose, 0.02).expect("finite");
        let angle = orientation_margin_rad(&arm, &pose, 0.005).expect("finite");
        if !arm.is_reachable(&pose) {
            assert_eq!((radius, angle), (None, None));
            none += 1;
            continue;
        }
        for (radius, cone) in radius
            .map(|r| (r, 0.02))
            .into_iter()
            .chain(angle.map(|a| (0.005, a)))
        {
            some += 1;
            for _ in 0..30 {
                let turn = DMat3::from_axis_angle(sampler.unit_vector(), cone);
                let off = at + sampler.unit_vector() * radius;
                let moved = Pose::new(turn * facing, off).expect("finite");
                assert!(arm.is_reachable(&moved), "{at} {radius} {cone}");
            }
        }
    }
    assert!(some > 300 && none > 100, "{some} {none}");
    let pose = Pose::new(facing, DVec3::new(0.6, 0.0, 0.5)).expect("finite");
    assert!(position_margin_m(&arm, &pose, f64::NAN).is_err());
    assert!(position_margin_m(&arm, &pose, -1.0).is_err());
    assert!(orientation_margin_rad(&arm, &pose, f64::INFINITY).is_err());
}

#[test]
fn reasons_add_up() {
    let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default()).expect("valid");
    let plane = WallPlane::new(0.3, 0.1).expect("finite");
    let (s, z) = (Interval::new(-1.0, 1.0), Interval::new(-0.3, 1.3));
    let reasons = ReachabilityReasons::of_wall(&solver, &plane, s, z, 0.05).expect("counted");
    assert_eq!(reasons.total(), 41 * 33);
    for wanted in ["reachable", "too_far", "elbow_limit"] {
        let found = reasons.rows().into_iter().find(|(name, _)| *name == wanted);
        assert!(found.is_some_and(|(_, count)| count > 0), "{wanted}");
    }
    assert!(ReachabilityReasons::of_wall(&solver, &plane, s, z, 0.0).is_err());
    assert!(matches!(
        ReachabilityReasons::of_wall(&solver, &plane, s, z, 1e-9),
        Err(ReachabilityError::TooMany { .. })
    ));
}
