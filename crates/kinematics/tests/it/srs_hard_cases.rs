//! Hard cases of closed forms: singularities, limits, full stretch, isolated solutions.
//!
//! Each pose is computed from a configuration, so it is reachable by construction; the limits are
//! closed around that configuration, down to zero width.

use crate::chain_support::{geometry, lengths_m};
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    Branch, JointLimit, JointPositions, NearestConfig, Pose, SrsArm, SrsGeometry, SrsParameters,
    Unreachable, Verdict,
};
use hwall_testkit::{Sampler, refusal};
use std::f64::consts::PI;

const SEED: u64 = 20_261;

/// The pose is reachable, and its witness is within the limits.
pub(crate) fn assert_holds(arm: &SrsArm, pose: &Pose, tolerance: f64, what: &str) {
    match arm.verdict(pose) {
        Verdict::Reachable(witness) => {
            for (joint, (q, limit)) in witness.q.0.iter().zip(arm.limits()).enumerate() {
                assert!(
                    limit.contains(*q),
                    "{what}: joint {joint} at {q} outside {limit:?}"
                );
            }
            let off = arm.forward(&witness.q).distance(pose);
            assert!(
                off.position_m <= tolerance && off.angle_rad <= tolerance,
                "{what}: {off:?}"
            );
        }
        Verdict::Unreachable(reason) => panic!("{what}: {reason}, {pose:?}"),
    }
    assert!(arm.is_reachable(pose), "{what}");
}

/// A configuration with some joints set, the others random and away from their singularity.
fn configuration(sampler: &mut Sampler, set: &[(usize, f64)]) -> JointPositions {
    let arm = SrsArm::iiwa7();
    let mut q = sampler.array_within(arm.limits().map(|l| (0.95 * l.min_rad, 0.95 * l.max_rad)));
    for joint in [1, 3, 5] {
        q[joint] = q[joint].abs().max(0.2).copysign(q[joint]);
    }
    for &(joint, value) in set {
        q[joint] = value;
    }
    JointPositions(q)
}

/// Many configurations: reachable with the iiwa's own limits, and with limits closed to boxes of the given half widths around the configuration.
fn check_boxes(name: &str, half_widths: &[f64], set: impl Fn(&mut Sampler) -> Vec<(usize, f64)>) {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for i in 0..2_000 {
        let values = set(&mut sampler);
        let q = configuration(&mut sampler, &values);
        let pose = arm.forward(&q);
        assert_holds(&arm, &pose, 1e-12, &format!("{name} {i} {q:?}"));
        for &half_width in half_widths {
            let limits = q.0.map(|x| JointLimit::new(x - half_width, x + half_width));
            let tight = arm
                .with_limits(limits)
                .expect("limits around a configuration");
            let what = format!("{name} {i}, limits {half_width} around {q:?}");
            assert_holds(&tight, &pose, 1e-12, &what);
        }
    }
}

#[test]
fn regular_and_singular_configurations_and_joints_at_their_limits_in_boxes() {
    let wide = [0.1, 1e-3, 1e-6];
    for subset in 0..8 {
        let zero = |bit: &usize| subset >> bit & 1 == 1;
        let set: Vec<_> = (0..3).filter(zero).map(|bit| (2 * bit + 1, 0.0)).collect();
        check_boxes(&format!("zeros {set:?}"), &wide, |_| set.clone());
    }
    // Wrist above the shoulder: q2 is half the elbow's bend, any q1 and q3 = 0.
    check_boxes("wrist on the base axis", &wide, |s| {
        let q4 = s.uniform(0.2, 2.0);
        vec![(1, 0.5 * q4), (2, 0.0), (3, q4)]
    });
    for near in [1e-6, 1e-9, 1e-12] {
        // Double precision determines the elbow of a pose that is near all of them too coarsely for boxes (docs of `verdict`).
        for (joints, half_widths) in [
            (&[1][..], &wide[..2]),
            (&[3], &wide[..2]),
            (&[5], &wide[..2]),
            (&[1, 3, 5], &[]),
        ] {
            check_boxes(&format!("{joints:?} = ±{near}"), half_widths, |s| {
                let sign = |joint: &usize| (*joint, if s.bool() { near } else { -near });
                joints.iter().map(sign).collect()
            });
        }
    }
    for (joint, limit) in SrsArm::iiwa7().limits().iter().enumerate() {
        for end in [limit.min_rad, limit.max_rad] {
            check_boxes(&format!("joint {joint} at {end}"), &[], |_| {
                vec![(joint, end)]
            });
        }
    }
}

#[test]
fn locked_joints_leave_the_pose_reachable() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for i in 0..5_000 {
        let q = configuration(&mut sampler, &[]);
        let pose = arm.forward(&q);
        let mut limits = *arm.limits();
        // One to three joints locked exactly at their angle.
        for _ in 0..=sampler.index(3) {
            let joint = sampler.index(7);
            limits[joint] = JointLimit::new(q[joint], q[joint]);
        }
        let tight = arm.with_limits(limits).expect("valid");
        assert_holds(&tight, &pose, 1e-12, &format!("locked {i} {q:?}"));
    }
}

#[test]
fn all_joints_within_a_thousandth_of_their_limits() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for i in 0..5_000 {
        let q = JointPositions(arm.limits().map(|l| {
            let inset = sampler.uniform(0.0, 1e-3);
            if sampler.bool() {
                l.min_rad + inset
            } else {
                l.max_rad - inset
            }
        }));
        assert_holds(&arm, &arm.forward(&q), 1e-12, &format!("corner {i} {q:?}"));
        let corner = JointPositions(std::array::from_fn(|j| {
            let l = arm.limits()[j];
            if q[j] < 0.0 { l.min_rad } else { l.max_rad }
        }));
        assert_holds(&arm, &arm.forward(&corner), 1e-12, "exact corner");
    }
}

#[test]
fn solutions_at_a_single_arm_angle_are_found() {
    // Elbow on the base axis with q1 and q3 such that half a turn of both leaves the limits: the
    // neighbouring arm angles swing q1 by a quarter turn and lose the pose.
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for (singular, first, third) in [(1, 0, 2), (5, 4, 6)] {
        for i in 0..2_000 {
            let q = configuration(&mut sampler, &[(singular, 0.0)]);
            let mut limits = *arm.limits();
            for joint in [first, third] {
                limits[joint] = JointLimit::new(q[joint] - 1e-3, q[joint] + 1e-3);
            }
            let tight = arm.with_limits(limits).expect("valid");
            let pose = arm.forward(&q);
            assert_holds(&tight, &pose, 1e-12, &format!("single angle {i} {q:?}"));
            let angles = tight.feasible_arm_angles(&pose).expect("reachable");
            for branch in angles.branches() {
                for arc in angles.arcs(branch) {
                    let middle = 0.5 * (arc.start_rad + arc.end_rad);
                    let q = angles.configuration(&tight, branch, middle, &q);
                    let off = tight.forward(&q.expect("held")).distance(&pose);
                    assert!(off.position_m < 1e-12 && off.angle_rad < 1e-12);
                }
            }
        }
    }
}

#[test]
fn full_stretch_inside_and_outside() {
    let arm = SrsArm::iiwa7();
    let shoulder = DVec3::new(0.0, 0.0, 0.34);
    let mut sampler = Sampler::new(SEED);
    for _ in 0..1_000 {
        let direction = sampler.unit_vector();
        // The tool along the stretched arm, so that the wrist is straight too.
        let x = direction.any_orthonormal_vector();
        let rotation = DMat3::from_cols(x, direction.cross(x), direction);
        let at = |extra: f64| {
            let wrist = shoulder + direction * (0.8 + extra);
            Pose::new(rotation, wrist + direction * 0.126).expect("a pose")
        };
        let upright = direction.z > -0.45; // q2 within 120 degrees
        for extra in [0.0, 1e-16, -1e-16, -1e-12, -1e-9] {
            if upright {
                assert_holds(&arm, &at(extra), 1e-12, &format!("stretch {extra}"));
            }
        }
        for extra in [1e-12, 1e-9] {
            match arm.verdict(&at(extra)) {
                Verdict::Unreachable(Unreachable::TooFar { gap_m }) => {
                    assert!((gap_m - extra).abs() < 1e-14, "{gap_m}");
                }
                other => panic!("{extra}: {other:?}"),
            }
        }
    }
}

#[test]
fn wrist_centre_on_the_shoulder() {
    let at = |height_m: f64| Pose::from_translation(DVec3::Z * (height_m + 0.126)).expect("a pose");
    // The iiwa's elbow stops at 120 degrees, 0.4 m away.
    match SrsArm::iiwa7().verdict(&at(0.34)) {
        Verdict::Unreachable(Unreachable::ElbowLimit { gap_m }) => {
            assert!((gap_m - 0.4).abs() < 1e-12)
        }
        other => panic!("{other:?}"),
    }
    // An arm that folds almost flat does not reach it either.
    let mut limits = *SrsArm::iiwa7().limits();
    limits[3] = JointLimit::symmetric_deg(179.9);
    let folding = SrsArm::iiwa7().with_limits(limits).expect("valid");
    assert!(!folding.is_reachable(&at(0.34)));
    // With unequal links the geometry excludes it.
    match SrsArm::iiwa14().verdict(&at(0.36)) {
        Verdict::Unreachable(Unreachable::TooNear { gap_m }) => {
            assert!((gap_m - 0.02).abs() < 1e-12)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn asymmetric_limits_and_free_joints() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for i in 0..10_000 {
        let limits = std::array::from_fn(|joint| {
            let widest = if joint % 2 == 1 { 3.1 } else { 3.0 * PI };
            let [a, b] = sampler.array_within([(-widest, widest); 2]);
            if joint % 2 == 0 && sampler.index(4) == 0 {
                JointLimit::FREE
            } else {
                JointLimit::new(a.min(b), a.max(b))
            }
        });
        let tight = arm.with_limits(limits).expect("valid");
        let q = JointPositions(limits.map(|l: JointLimit| {
            if l.min_rad.is_finite() {
                sampler.uniform(l.min_rad, l.max_rad)
            } else {
                sampler.uniform(-9.0, 9.0)
            }
        }));
        let what = format!("limits {i} {limits:?} {q:?}");
        assert_holds(&tight, &arm.forward(&q), 1e-12, &what);
    }
}

#[test]
fn arms_of_any_size_and_links_and_tools() {
    let p = SrsParameters::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let mut check = |arm: &SrsArm, size: f64, what: &str| {
        for i in 0..2_000 {
            let set: &[(usize, f64)] = if i % 2 == 0 { &[] } else { &[(3, 0.0)] };
            let pose = arm.forward(&configuration(&mut sampler, set));
            assert_holds(arm, &pose, 1e-12 * size.max(1.0), &format!("{what} {i}"));
        }
    };
    let iiwa = lengths_m(&p.geometry);
    for (size, links_m) in [
        (1e-3, iiwa),
        (10.0, iiwa),
        (1e3, iiwa),
        (1.0, [0.0, 0.5, 0.2, 0.1]),
        (1.0, [0.0, 0.2, 0.5, 0.0]),
        (1.0, [0.0, 0.3, 0.31, -0.05]),
    ] {
        let geometry = geometry(links_m.map(|length_m| size * length_m));
        let arm = SrsArm::new(SrsParameters { geometry, ..p }).expect("valid");
        check(&arm, size, &format!("{links_m:?} times {size}"));
    }
    let mut tools = Sampler::new(SEED);
    for _ in 0..5 {
        let tool = Pose::new(tools.rotation(), tools.unit_vector() * 0.3).expect("a pose");
        check(&SrsArm::iiwa7().with_tool(tool), 1.0, "tool");
    }
}

#[test]
fn bad_models_are_named() {
    let p = SrsParameters::iiwa7();
    let with_limit = |joint: usize, min_rad: f64, max_rad: f64| {
        let mut limits = p.limits;
        limits[joint] = JointLimit::new(min_rad, max_rad);
        SrsArm::new(SrsParameters { limits, ..p })
    };
    let with_forearm = |d_ew_m: f64| {
        let geometry = SrsGeometry {
            d_ew_m,
            ..p.geometry
        };
        SrsArm::new(SrsParameters { geometry, ..p })
    };
    for (made, named) in [
        (with_limit(2, 1.0, -1.0), "joint 2: limits reversed"),
        (with_limit(0, f64::NAN, 1.0), "[0] is NaN"),
        (with_limit(3, -1.0, PI), "joint 3: limits [-1, 3.14"),
        (with_forearm(0.0), "link length d_ew is 0 m"),
        (with_forearm(-0.4), "link length d_ew is -0.4 m"),
        (with_forearm(f64::NAN), "link length d_ew is NaN m"),
        (with_forearm(f64::INFINITY), "link length d_ew is inf m"),
    ] {
        let said = refusal(made);
        assert!(said.contains(named), "{said}");
    }
    let six = refusal(JointPositions::from_slice(&[0.0; 6]));
    assert!(six.contains("has 6 values, the arm has 7"), "{six}");
}

#[test]
fn nan_never_passes_silently() {
    let arm = SrsArm::iiwa7();
    let pose = arm.forward(&JointPositions([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1]));
    assert_eq!(arm.solutions(&pose, f64::NAN), [None; 8]);
    assert_eq!(arm.solutions(&pose, f64::INFINITY), [None; 8]);
    let bad = JointPositions([0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let said = refusal(arm.nearest_solution(&pose, &bad, &NearestConfig::default()));
    assert_eq!(said, "reference[1] is NaN, not a finite number");
    assert!(arm.arm_angle(&bad).is_nan());
    assert!(arm.self_motion(&bad).0.iter().all(|x| x.is_nan()));
    assert!(arm.dexterity(&bad, 0.1).manipulability.is_nan());
    assert!(arm.forward(&bad).position_m().is_nan());
    let angles = arm.feasible_arm_angles(&pose).expect("reachable");
    for branch in Branch::ALL {
        let nowhere = angles.configuration(&arm, branch, f64::NAN, &JointPositions::default());
        assert_eq!(nowhere, None);
    }
}

#[test]
fn random_limits_full_of_locked_joints() {
    // Limits anywhere within ±7 rad, many of zero width, the configuration often exactly on them.
    let mut sampler = Sampler::new(99);
    let arm = SrsArm::iiwa7();
    let (mut lost, mut cases) = (0, 0);
    while cases < 100_000 {
        let limits: [JointLimit; 7] = std::array::from_fn(|joint| {
            let tilting = joint % 2 == 1;
            let width = [
                0.0,
                1e-6,
                0.01,
                sampler.uniform(0.0, 2.0),
                sampler.uniform(0.0, if tilting { 2.0 } else { 8.0 }),
            ][sampler.index(5)];
            let widest = if tilting { 3.1 } else { 7.0 };
            let min_rad = sampler.uniform(-widest, if tilting { 3.1 - width } else { widest });
            JointLimit::new(min_rad, min_rad + width)
        });
        let q = JointPositions(limits.map(|l| match sampler.index(4) {
            0 => l.min_rad,
            1 => l.max_rad,
            _ => sampler.uniform(l.min_rad, l.max_rad),
        }));
        if q[3].abs() < 1e-6 {
            continue;
        }
        cases += 1;
        let tight = arm.with_limits(limits).expect("valid limits");
        let pose = arm.forward(&q);
        if tight.is_reachable(&pose) {
            assert_holds(&tight, &pose, 1e-12, &format!("{limits:?} {q:?}"));
        } else {
            lost += 1;
        }
    }
    // Not resolvable in double precision (docs of `verdict`).
    assert!(lost <= 60, "{lost} of {cases}");
    println!("{lost} of {cases} poses of locked joints lost");
}
