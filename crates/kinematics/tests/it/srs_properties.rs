//! Identities of the S-R-S arm that need no reference.

use glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, Branch, BranchPolicy, JointLimit, JointPositions, JointTorques, JointVelocities,
    KinematicsError, NearestConfig, Pose, SrsArm, Unreachable, Verdict, Wrench, WrenchConfig,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close, refusal};
use std::f64::consts::{PI, TAU};

const SEED: u64 = 7;

fn random_q(arm: &SrsArm, sampler: &mut Sampler) -> JointPositions {
    JointPositions(sampler.array_within(arm.limits().map(|l| (l.min_rad, l.max_rad))))
}

fn with_tool() -> SrsArm {
    let tool = Pose::from_quat(
        glam::DQuat::from_rotation_y(0.3),
        DVec3::new(0.02, -0.05, 0.09),
    );
    SrsArm::iiwa7().with_tool(tool.expect("a pose"))
}

fn assert_holds(arm: &SrsArm, q: &JointPositions, pose: &Pose) {
    let off = arm.forward(q).distance(pose);
    assert!(off.position_m < 1e-12 && off.angle_rad < 1e-12, "{off:?}");
}

/// A pose within the arm's length, reachable or not.
fn random_pose(sampler: &mut Sampler) -> Pose {
    let wrist = DVec3::new(0.0, 0.0, 0.34) + sampler.unit_vector() * sampler.uniform(0.38, 0.81);
    let rotation = sampler.rotation();
    Pose::new(rotation, wrist + rotation.z_axis * 0.126).expect("a pose")
}

fn with(policy: BranchPolicy) -> NearestConfig {
    NearestConfig {
        policy,
        ..NearestConfig::default()
    }
}

/// The difference of two angles, at most half a turn to either side.
fn turned_rad(to: f64, from: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}

fn damped(damping_m: f64) -> WrenchConfig {
    WrenchConfig {
        damping_m,
        ..WrenchConfig::default()
    }
}

#[test]
fn torques_do_the_work_of_the_wrench() {
    let mut sampler = Sampler::new(SEED);
    let arm = with_tool();
    for _ in 0..500 {
        let q = random_q(&arm, &mut sampler);
        let qd = JointVelocities(sampler.array_within([(-1.0, 1.0); 7]));
        let wrench = Wrench {
            force_n: sampler.unit_vector() * 10.0,
            moment_n_m: sampler.unit_vector(),
        };
        let twist = arm.jacobian(&q).twist(&qd);
        let power = wrench.force_n.dot(twist.linear_m_per_s)
            + wrench.moment_n_m.dot(twist.angular_rad_per_s);
        let torques = arm.torques_from_wrench(&q, &wrench);
        let joint_power: f64 = torques.0.iter().zip(qd.0).map(|(t, v)| t * v).sum();
        assert_close!(joint_power, power, Tol::abs(1e-12));
        let estimate = arm
            .wrench_from_torques(&q, &torques, &damped(0.0))
            .expect("finite");
        if arm.jacobian(&q).condition(0.1) < 1e4 {
            let found = estimate.wrench.to_array();
            assert_close!(found, wrench.to_array(), Tol::abs(1e-7));
        }
        assert!(estimate.residual_n_m < 1e-7);
    }
}

#[test]
fn damping_holds_the_estimate_back_at_a_singularity() {
    let arm = SrsArm::iiwa7();
    let straight = JointPositions([0.0; 7]);
    let noise = JointTorques([0.1; 7]);
    let estimate = arm
        .wrench_from_torques(&straight, &noise, &damped(0.05))
        .expect("finite");
    assert!(arm.jacobian(&straight).condition(0.1) > 1e7);
    assert!(estimate.wrench.force_n.length() < 0.1 * 7.0_f64.sqrt() / (2.0 * 0.05) * 1.0001);
    assert!(estimate.wrench.to_array().iter().all(|x| x.is_finite()));
    for bad in [-1.0, f64::NAN] {
        let said = refusal(arm.wrench_from_torques(&straight, &noise, &damped(bad)));
        assert!(said.starts_with("damping_m is "), "{said}");
    }
}

#[test]
fn eight_branches_hold_the_pose_at_the_asked_arm_angle() {
    let mut sampler = Sampler::new(SEED);
    let mut seen = [0; 8];
    for arm in [SrsArm::iiwa7(), with_tool()] {
        for _ in 0..3_000 {
            let q = random_q(&arm, &mut sampler);
            let pose = arm.forward(&q);
            let psi = arm.arm_angle(&q);
            let solutions = arm.solutions(&pose, psi);
            let own = solutions[Branch::of(&q).index()].expect("its own branch");
            let scale = 1.0 / q[1].sin().abs().min(q[3].sin().abs()).min(q[5].sin().abs());
            assert!(
                own.max_abs_difference(&q) < 1e-13 * scale * scale,
                "{q:?} {own:?}"
            );
            for (branch, solution) in Branch::ALL.into_iter().zip(solutions) {
                let Some(solution) = solution else { continue };
                seen[branch.index()] += 1;
                assert_eq!(Branch::of(&solution), branch);
                assert_holds(&arm, &solution, &pose);
                let turned = turned_rad(arm.arm_angle(&solution), psi);
                assert!(turned.abs() < 1e-12 * scale, "{turned}");
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 500), "{seen:?}");
}

#[test]
fn feasible_arcs_agree_with_dense_sampling() {
    let mut sampler = Sampler::new(SEED);
    let (mut inside, mut outside) = (0_u64, 0_u64);
    for case in 0..600 {
        let limits = if case % 2 == 0 {
            *SrsArm::iiwa7().limits()
        } else {
            std::array::from_fn(|joint| {
                let widest = if joint % 2 == 1 { 2.5 } else { 3.3 };
                let middle = sampler.uniform(-0.8, 0.8);
                let half = sampler.uniform(0.4, widest - 0.8);
                JointLimit::new(middle - half, middle + half)
            })
        };
        let arm = SrsArm::iiwa7().with_limits(limits).expect("valid");
        let pose = random_pose(&mut sampler);
        let angles = arm.feasible_arm_angles(&pose);
        assert_eq!(angles.is_ok(), arm.is_reachable(&pose));
        for i in 0..720 {
            let psi = -PI + TAU * (f64::from(i) + 0.5) / 720.0;
            for (branch, solution) in Branch::ALL.into_iter().zip(arm.solutions(&pose, psi)) {
                let Ok(angles) = &angles else {
                    assert_eq!(solution, None, "case {case}: unreachable, yet {solution:?}");
                    continue;
                };
                let arcs = angles.arcs(branch);
                let distances = arcs.map(|arc| turned_rad(arc.nearest_rad(psi), psi).abs());
                let distance = distances.fold(f64::INFINITY, f64::min);
                if solution.is_some() {
                    inside += 1;
                    assert!(
                        distance < 1e-9,
                        "case {case}: psi {psi} missed by {distance}"
                    );
                } else {
                    outside += 1;
                    assert!(distance > 0.0, "case {case}: psi {psi} wrongly inside");
                }
            }
        }
    }
    assert!(inside > 100_000 && outside > 100_000, "{inside} {outside}");
}

#[test]
fn arc_ends_are_limits() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    let mut ends = 0;
    for _ in 0..500 {
        let pose = arm.forward(&random_q(&arm, &mut sampler));
        let angles = arm.feasible_arm_angles(&pose).expect("reachable");
        for branch in angles.branches() {
            for arc in angles.arcs(branch) {
                if arc.width_rad() >= TAU {
                    continue;
                }
                for end in [arc.start_rad, arc.end_rad] {
                    ends += 1;
                    let q = angles
                        .configuration(&arm, branch, end, &JointPositions::default())
                        .expect("closed: the end belongs to the arc");
                    let distance = arm.nearest_limit(&q).distance_rad;
                    assert!((-1e-15..1e-9).contains(&distance), "{distance}");
                }
            }
        }
    }
    assert!(ends > 1_000);
}

#[test]
fn margin_is_the_largest_shrink() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    for _ in 0..200 {
        let pose = random_pose(&mut sampler);
        let Some(margin) = arm.joint_margin_rad(&pose) else {
            assert!(!arm.is_reachable(&pose));
            continue;
        };
        assert_eq!(margin >= 0.0, arm.is_reachable(&pose));
        let shrunk = |by: f64| {
            arm.with_limits(arm.limits().map(|l| l.shrunk(by)))
                .expect("valid")
        };
        assert!(shrunk(margin - 1e-9).is_reachable(&pose));
        assert!(!shrunk(margin + 1e-9).is_reachable(&pose));
    }
}

#[test]
fn nearest_is_no_worse_than_any_sample() {
    let mut sampler = Sampler::new(SEED);
    let arm = SrsArm::iiwa7();
    let any = with(BranchPolicy::Any);
    let cost = |a: &JointPositions, b: &JointPositions| -> f64 {
        a.0.iter().zip(b.0).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut excess = Vec::new();
    for _ in 0..500 {
        let pose = arm.forward(&random_q(&arm, &mut sampler));
        let reference = random_q(&arm, &mut sampler);
        let found = arm.nearest_solution(&pose, &reference, &any);
        let found = found.expect("reachable");
        assert_holds(&arm, &found.q, &pose);
        let sampled = (0..2_000)
            .flat_map(|i| arm.solutions(&pose, TAU * f64::from(i) / 2_000.0))
            .flatten()
            .map(|q| cost(&q, &reference))
            .fold(f64::INFINITY, f64::min);
        excess.push((cost(&found.q, &reference) - sampled).max(0.0));
    }
    let stats = ErrorStats::from_errors(excess);
    // Near a singularity the cost has valleys narrower than the spacing of the starting points.
    assert!(stats.q99 < 1e-5 && stats.max < 0.5, "{stats}");
}

#[test]
fn servoing_follows_without_jumps() {
    // The tool follows the path of a slow joint motion; the closed form must follow with steps
    // of the same size, through sign changes of joints 2 and 6 too.
    let mut sampler = Sampler::new(SEED);
    let arm = with_tool();
    let mut moves = Vec::new();
    for _ in 0..40 {
        let from = random_q(&arm, &mut sampler).0.map(|x| 0.8 * x);
        let to = random_q(&arm, &mut sampler).0.map(|x| 0.8 * x);
        if (from[3] > 0.0) != (to[3] > 0.0) {
            continue; // through the straight elbow the tool motion itself requires a large joint motion
        }
        let mut q = JointPositions(from);
        for step in 1..=1_000 {
            let t = f64::from(step) / 1_000.0;
            let path = JointPositions(std::array::from_fn(|i| from[i] + t * (to[i] - from[i])));
            let pose = arm.forward(&path);
            let found = arm
                .nearest_solution(&pose, &q, &NearestConfig::default())
                .expect("reachable");
            assert_holds(&arm, &found.q, &pose);
            moves.push(found.largest_move_rad);
            q = found.q;
        }
    }
    let stats = ErrorStats::from_errors(moves);
    assert!(
        stats.median < 5e-3 && stats.q99 < 0.03,
        "largest joint move a step: {stats}"
    );
}

#[test]
fn keep_policy_names_the_other_branch() {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let keep = NearestConfig {
        sign_change_rad: 0.0,
        ..with(BranchPolicy::Keep)
    };
    let (mut kept, mut refused) = (0, 0);
    for _ in 0..2_000 {
        let pose = arm.forward(&random_q(&arm, &mut sampler));
        let reference = random_q(&arm, &mut sampler);
        match arm.nearest_solution(&pose, &reference, &keep) {
            Ok(found) => {
                kept += 1;
                assert_eq!(found.branch, Branch::of(&reference));
                assert!(!found.branch_changed);
            }
            Err(KinematicsError::Unreachable(Unreachable::OtherBranch)) => {
                refused += 1;
                let any = arm.nearest_solution(&pose, &reference, &NearestConfig::default());
                assert!(any.is_ok());
            }
            Err(other) => panic!("{other}"),
        }
    }
    assert!(kept > 500 && refused > 5, "{kept} {refused}");
}

/// A joint at its limit, and a pose that would need it to go further: the others take over.
#[test]
fn beside_a_limit_the_other_joints_take_over() {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let (mut taken_over, mut missed) = (0, 0);
    for _ in 0..20_000 {
        let mut reference = random_q(&arm, &mut sampler);
        let joint = sampler.index(7);
        reference[joint] = arm.limits()[joint].max_rad;
        let mut beyond = reference;
        beyond[joint] += 0.01;
        let pose = arm.forward(&beyond);
        let beside = arm.nearest_solution(&pose, &reference, &with(BranchPolicy::Beside));
        let keep = arm.nearest_solution(&pose, &reference, &with(BranchPolicy::Keep));
        match beside {
            Ok(found) => {
                assert_holds(&arm, &found.q, &pose);
                assert!(found.largest_move_rad <= 0.3);
                taken_over += 1;
            }
            Err(_) => missed += usize::from(keep.is_ok_and(|kept| kept.largest_move_rad <= 0.3)),
        }
    }
    assert!(taken_over > 5_000 && missed == 0, "{taken_over} {missed}");
}

#[test]
fn self_motion_leaves_the_tool_at_rest() {
    let mut sampler = Sampler::new(SEED);
    let arm = with_tool();
    for _ in 0..1_000 {
        let q = random_q(&arm, &mut sampler);
        let (pose, jacobian) = arm.forward_and_jacobian(&q);
        let motion = arm.self_motion(&q);
        let square: f64 = motion.0.iter().map(|x| x * x).sum();
        assert_close!(square, 1.0, Tol::abs(1e-12));
        let twist = jacobian.twist(&motion);
        assert_close!(twist.to_array(), [0.0; 6], Tol::abs(1e-13));
        // The arm angle increases along it.
        let h = 1e-6;
        let moved = JointPositions(std::array::from_fn(|i| q[i] + h * motion[i]));
        let turned = turned_rad(arm.arm_angle(&moved), arm.arm_angle(&q));
        let wrist = arm.skeleton_m(&q)[2] - arm.skeleton_m(&q)[0];
        if wrist.truncate().length() > 0.1 && q[3].abs() > 0.1 {
            assert!(turned > 0.0, "{turned} at {q:?}");
        }
        assert!(arm.forward(&moved).distance(&pose).position_m < 1e-10);
        let velocity = JointVelocities(sampler.array_within([(-1.0, 1.0); 7]));
        let part = arm.null_space_part(&q, &velocity);
        assert_close!(jacobian.twist(&part).to_array(), [0.0; 6], Tol::abs(1e-12));
    }
}

#[test]
fn dexterity_is_zero_exactly_where_the_arm_is_singular() {
    let arm = SrsArm::iiwa7();
    let singular = arm.dexterity(&JointPositions([0.3, 0.7, 0.1, 0.0, 0.2, 0.0, 0.4]), 0.1);
    assert!(singular.isotropy() < 1e-7 && singular.manipulability < 1e-9);
    let bent = arm.dexterity(&JointPositions([0.3, 0.7, 0.1, -1.5, 0.2, 0.9, 0.4]), 0.1);
    assert!(bent.isotropy() > 0.01 && bent.isotropy() < 1.0);
}

#[test]
fn presets_reach_what_the_data_sheet_says() {
    for (arm, reach_m) in [(SrsArm::iiwa7(), 0.8), (SrsArm::iiwa14(), 0.82)] {
        let stretched = arm.forward(&JointPositions([0.0, PI / 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert_close!(stretched.position_m().x, reach_m + 0.126, Tol::abs(1e-12));
        let height_m = arm.geometry().d_bs_m;
        assert_close!(stretched.position_m().z, height_m, Tol::abs(1e-12));
        match arm.verdict(&stretched) {
            Verdict::Reachable(w) => assert!(w.q[3].abs() < 1e-7),
            other => panic!("{other:?}"),
        }
    }
}

#[cfg(feature = "serde")]
#[test]
fn models_and_poses_survive_a_file_and_bad_ones_do_not() {
    let arm = with_tool();
    let mut limits = *arm.limits();
    limits[6] = JointLimit::FREE;
    let free = arm.with_limits(limits).expect("valid");
    let text = |arm: &SrsArm| serde_json::to_string(arm).expect("serializable");
    for arm in [&arm, &free] {
        let back: SrsArm = serde_json::from_str(&text(arm)).expect("an arm");
        assert_eq!(&back, arm);
    }
    let text = text(&arm);
    let broken = text.replace("\"d_se_m\":0.4", "\"d_se_m\":-0.4");
    assert!(serde_json::from_str::<SrsArm>(&broken).is_err());
}
