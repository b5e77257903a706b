//! The S-R-S arm against results of independent tools (tests/data/README.md).

use glam::{DMat3, DVec3};
use hwall_kinematics::{JointPositions, Pose, PoseDistance, SrsArm, Unreachable, Verdict};
use hwall_testkit::{Tol, assert_close};
use serde_json::Value;
use std::path::Path;

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("an array")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

fn rows(m: &[f64]) -> DMat3 {
    DMat3::from_cols_slice(m).transpose()
}

fn load(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name);
    serde_json::from_str(&std::fs::read_to_string(path).expect("test data")).expect("JSON")
}

/// The complete set is beside the workspace only on some machines.
fn load_complete(name: &str) -> Option<Value> {
    let path = hwall_testkit::shared(&format!("reference/kinematics/{name}"))?;
    let text = std::fs::read_to_string(path).expect("reference file");
    Some(serde_json::from_str(&text).expect("JSON"))
}

fn check_forward(data: &Value) -> usize {
    let arm = SrsArm::iiwa7();
    let tol = Tol::abs(1e-12);
    let cases: Vec<&Value> = ["random", "hard"]
        .iter()
        .flat_map(|k| data[*k].as_array().expect("cases"))
        .collect();
    for case in &cases {
        let q = JointPositions::from_slice(&numbers(&case["q"])).expect("seven angles");
        let (pose, jacobian) = arm.forward_and_jacobian(&q);
        assert_close!(
            pose.position_m(),
            DVec3::from_slice(&numbers(&case["p"])),
            tol
        );
        assert_close!(pose.rotation(), rows(&numbers(&case["R"])), tol);
        assert_close!(jacobian.to_rows().concat(), numbers(&case["Jw"]), tol);
    }
    cases.len()
}

#[test]
fn forward_and_jacobian_agree_with_the_reference_to_1e_12() {
    assert_eq!(check_forward(&load("kinematics_dynamics.json")), 131);
    if let Some(data) = load_complete("kinematics_dynamics.json") {
        assert_eq!(check_forward(&data), 311);
    }
}

fn check_reach(data: &Value) -> usize {
    let arm = SrsArm::iiwa7();
    let poses = data["poses"].as_array().expect("poses");
    for (i, case) in poses.iter().enumerate() {
        let pose = Pose::new(
            rows(&numbers(&case["R"])),
            DVec3::from_slice(&numbers(&case["p"])),
        )
        .expect("a pose");
        let reachable = case["reachable"].as_bool().expect("bool");
        let verdict = arm.verdict(&pose);
        assert_eq!(
            verdict.is_reachable(),
            reachable,
            "pose {i} {}: {verdict:?}, margin {}",
            case["cls"],
            case["margin"]
        );
        assert_eq!(arm.is_reachable(&pose), reachable, "pose {i}");
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
        if let Verdict::Reachable(witness) = verdict {
            for (q, limit) in witness.q.0.iter().zip(arm.limits()) {
                assert!(limit.contains(*q), "pose {i}: {q}");
            }
            let PoseDistance {
                position_m: position,
                angle_rad: angle,
            } = arm.forward(&witness.q).distance(&pose);
            assert!(
                position < 1e-12 && angle < 1e-12,
                "pose {i}: {position} m, {angle} rad"
            );
        }
        match (case["margin"].as_f64(), arm.joint_margin_rad(&pose)) {
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
    assert_eq!(check_reach(&load("reach_poses.json")), 744);
    if let Some(data) = load_complete("reach_poses.json") {
        assert_eq!(check_reach(&data), 1000);
    }
}
