//! Compares joints and capsules with the arm itself.

use crate::common;
use hwall::kinematics::{ArmKinematics, Chain, ChainArm, JointPositions, SrsArm};
use hwall_testkit::Sampler;
use hwall_view::ViewArm;

#[test]
fn the_tool_is_where_the_arm_has_it() {
    let chain = ChainArm::new(Chain::iiwa14()).unwrap();
    let arms: [&dyn ArmKinematics; 4] =
        [&SrsArm::iiwa7(), &SrsArm::iiwa14(), &common::arm(), &chain];
    let mut sampler = Sampler::new(3);
    for arm in arms {
        let shown = ViewArm::of(arm);
        assert_eq!(shown.joints.len(), 7);
        for _ in 0..500 {
            let q = JointPositions(std::array::from_fn(|_| sampler.uniform(-2.0, 2.0)));
            let tool = *shown.poses(&q).last().unwrap();
            let error = tool.distance(&arm.forward(&q));
            assert!(error.position_m < 1e-12, "{error:?}");
            assert!(error.angle_rad < 1e-12, "{error:?}");
        }
    }
}

/// The links of an iiwa: base to shoulder, shoulder to elbow, elbow to wrist, wrist to tool; neighbours meet in any configuration.
#[test]
fn links_hang_together() {
    let arm = ViewArm::of(&common::arm());
    let links: Vec<_> = arm.capsules.iter().filter(|c| !c.housing).collect();
    assert_eq!(links.len(), 4);
    assert!(arm.capsules.iter().filter(|c| c.housing).count() >= 3);
    let mut sampler = Sampler::new(4);
    for _ in 0..100 {
        let q = JointPositions(std::array::from_fn(|_| sampler.uniform(-2.0, 2.0)));
        let poses = arm.poses(&q);
        for pair in links.windows(2) {
            let end_m = poses[pair[0].frame].transform_point(pair[0].to_m);
            let start_m = poses[pair[1].frame].transform_point(pair[1].from_m);
            assert!(end_m.distance(start_m) < 1e-9);
        }
    }
}

#[test]
fn angles_that_are_nan_are_shown_as_zero() {
    let arm = ViewArm::of(&common::arm());
    let poses = arm.poses(&JointPositions([f64::NAN; 7]));
    assert_eq!(poses, arm.poses(&JointPositions::default()));
}
