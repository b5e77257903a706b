//! The S-R-S arm against results of independent tools (tests/data/README.md).

use crate::chain_support::{complete, excerpt, reach_poses};
use crate::srs_hard_cases::assert_holds;
use glam::DVec3;
use hwall_kinematics::{SrsArm, Unreachable, Verdict};
use hwall_testkit::{Tol, assert_close};
use serde_json::Value;

fn check_reach(data: &Value) -> usize {
    let arm = SrsArm::iiwa7();
    let poses = reach_poses(data);
    for (i, (pose, case)) in poses.iter().enumerate() {
        let case = &case.0;
        let reachable = case["reachable"].as_bool().expect("bool");
        let verdict = arm.verdict(pose);
        assert_eq!(
            verdict.is_reachable(),
            reachable,
            "pose {i} {}: {verdict:?}, margin {}",
            case["cls"],
            case["margin"]
        );
        assert_eq!(arm.is_reachable(pose), reachable, "pose {i}");
        let wrist = pose.position_m() - pose.rotation().z_axis * 0.126 - DVec3::Z * 0.34;
        match verdict {
            Verdict::Unreachable(Unreachable::TooFar { gap_m }) => {
                assert_close!(wrist.length() - 0.8, gap_m, Tol::abs(1e-12));
            }
            Verdict::Unreachable(Unreachable::ElbowLimit { gap_m }) => {
                assert_close!(0.4 - wrist.length(), gap_m, Tol::abs(1e-12));
            }
            // The iiwa folds no further than its elbow limit.
            Verdict::Unreachable(Unreachable::TooNear { .. }) => panic!("{i}: too near"),
            _ => assert!((0.4..=0.8).contains(&wrist.length()) || reachable),
        }
        if reachable {
            assert_holds(&arm, pose, 1e-12, &format!("pose {i}"));
        }
        match (case["margin"].as_f64(), arm.joint_margin_rad(pose)) {
            // The reference stopped its search at 2 rad.
            (Some(2.0), Some(got)) => assert!(got >= 2.0),
            // Borderline poses reach along a straight elbow, where 1e-16 m is 1e-8 rad.
            (Some(want), Some(got)) => {
                assert_close!(got, want, Tol::abs(2e-8), "pose {i} {}", case["cls"])
            }
            (None, got) => assert!(got.is_none_or(|m| m < 0.0), "pose {i}: {got:?}"),
            (want, got) => panic!("pose {i} {}: margin {got:?}, wanted {want:?}", case["cls"]),
        }
    }
    poses.len()
}

#[test]
fn verdicts_witnesses_and_margins_agree_with_the_reference() {
    assert_eq!(check_reach(&excerpt("reach_poses.json")), 744);
    if let Some(data) = complete("reach_poses.json") {
        assert_eq!(check_reach(&data), 1000);
    }
}
