//! Dynamics of general chains: reference data, identities, energy, invalid bodies.

use crate::chain_support::{Reference, franka, random_chain, random_q, references, shift};
use glam::DVec3;
use hwall_kinematics::{
    Chain, ChainDynamics, ChainJoint, GRAVITY_M_PER_S2, Inertial, JointLimit, KinematicsError,
    Pose, Wrench,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close, central_difference};

/// A random chain with a physical body on every link: a few point masses each.
pub(crate) fn random_dynamics(
    sampler: &mut Sampler,
    n: usize,
    prismatic_share: f64,
) -> ChainDynamics {
    let chain = random_chain(sampler, n, prismatic_share);
    let mut mass = || {
        let mass_kg = sampler.uniform(0.1, 2.0);
        Inertial::point("mass", mass_kg, sampler.unit_vector() * 0.2)
    };
    let joints = chain.joints().iter().map(|joint| ChainJoint {
        inertials: (0..4).map(|_| mass()).collect(),
        ..joint.clone()
    });
    let chain = Chain::new(joints.collect(), chain.link_from_tip()).unwrap();
    ChainDynamics::new(&chain).unwrap()
}

fn uniform(sampler: &mut Sampler, n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|_| sampler.uniform(-size, size)).collect()
}

/// Largest error of a quantity relative to its largest entry in that configuration.
fn relative(mine: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(mine.len(), expected.len());
    let scale = expected.iter().fold(1e-3, |m: f64, x| m.max(x.abs()));
    let errors = mine.iter().zip(expected).map(|(a, b)| (a - b).abs());
    errors.fold(0.0, f64::max) / scale
}

#[test]
fn iiwa7_agrees_with_pinocchio() {
    let arm = ChainDynamics::new(&Chain::iiwa7()).unwrap();
    let cases = references();
    let check = |key: &str, f: &dyn Fn(&Reference) -> Vec<f64>| {
        let errors = cases.iter().map(|c| relative(&f(c), &c.numbers(key)));
        let errors = ErrorStats::from_errors(errors);
        println!("{key}: relative error {errors}");
        assert!(errors.max < 1e-12, "{key}: {errors}");
    };
    check("g", &|case| arm.gravity_torque(&case.numbers("q")).unwrap());
    check("M", &|case| arm.mass_matrix(&case.numbers("q")).unwrap());
    check("nle", &|case| {
        arm.inverse(&case.numbers("q"), &case.numbers("qd"), &[0.0; 7])
            .unwrap()
    });
    let motion = |case: &Reference| ["q", "qd", "qdd"].map(|key| case.numbers(key));
    check("tau", &|case| {
        let [q, qd, qdd] = motion(case);
        arm.inverse(&q, &qd, &qdd).unwrap()
    });
    // Forward dynamics divide by the smallest eigenvalue of M, so the wrist's 3e-4 kg m² costs digits.
    let errors = ErrorStats::from_errors(cases.iter().map(|case| {
        let [q, qd, qdd] = motion(case);
        relative(&arm.forward(&q, &qd, &case.numbers("tau")).unwrap(), &qdd)
    }));
    println!("qdd: relative error {errors}");
    assert!(errors.max < 1e-9, "{errors}");
}

/// Columns of the mass matrix are torques of unit accelerations without gravity; with them the kinetic energy, and forward dynamics that undo
/// the inverse.
#[test]
fn mass_matrix_inverse_forward_and_kinetic_energy_agree() {
    let mut sampler = Sampler::new(31);
    for n in 1..=12 {
        let arm = random_dynamics(&mut sampler, n, 0.4);
        let floating = arm.clone().with_gravity(DVec3::ZERO).unwrap();
        for _ in 0..20 {
            let q = random_q(arm.chain(), &mut sampler);
            let qd = uniform(&mut sampler, n, 2.0);
            let m = arm.mass_matrix(&q).unwrap();
            let scale = m.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let mut energy = 0.0;
            for j in 0..n {
                let mut unit = vec![0.0; n];
                unit[j] = 1.0;
                let column = floating.inverse(&q, &vec![0.0; n], &unit).unwrap();
                for i in 0..n {
                    assert_close!(m[i * n + j], column[i], Tol::abs(1e-14 * scale));
                    assert_eq!(m[i * n + j], m[j * n + i]);
                    energy += 0.5 * qd[i] * m[i * n + j] * qd[j];
                }
            }
            assert!(energy > 0.0);
            let found = arm.kinetic_energy_j(&q, &qd).unwrap();
            assert_close!(found, energy, Tol::rel(1e-11));
            let qdd = uniform(&mut sampler, n, 5.0);
            let torques = arm.inverse(&q, &qd, &qdd).unwrap();
            assert_close!(arm.forward(&q, &qd, &torques).unwrap(), qdd, Tol::abs(1e-8));
        }
    }
}

#[test]
fn gravity_torque_is_the_gradient_of_the_potential() {
    let mut sampler = Sampler::new(34);
    for n in 1..=8 {
        let gravity = sampler.unit_vector() * 9.81;
        let arm = random_dynamics(&mut sampler, n, 0.4)
            .with_gravity(gravity)
            .unwrap();
        let q = random_q(arm.chain(), &mut sampler);
        let moved = |i: usize, to: f64| {
            let mut q = q.clone();
            q[i] = to;
            arm.potential_energy_j(&q).unwrap()
        };
        let gradient = (0..n).map(|i| central_difference(|x| moved(i, x), q[i], 1e-5));
        let gradient: Vec<f64> = gradient.collect();
        let torque = arm.gravity_torque(&q).unwrap();
        assert_close!(torque, gradient, Tol::abs(1e-7));
        let zero = vec![0.0; n];
        let at_rest = arm.inverse(&q, &zero, &zero).unwrap();
        assert_close!(torque, at_rest, Tol::abs(1e-12));
    }
}

/// One step of the classical Runge-Kutta method under constant torques.
fn step(arm: &ChainDynamics, q: &mut [f64], qd: &mut [f64], torques: &[f64], h: f64) {
    let (q0, qd0) = (q.to_vec(), qd.to_vec());
    let (mut slope_q, mut slope_qd) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    for (reach, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
        let along = |from: &[f64], slope: &[f64]| -> Vec<f64> {
            let pairs = from.iter().zip(slope);
            pairs.map(|(x, s)| x + reach * h * s).collect()
        };
        let (at_q, at_qd) = (along(&q0, &slope_q), along(&qd0, &slope_qd));
        slope_qd = arm.forward(&at_q, &at_qd, torques).unwrap();
        slope_q = at_qd;
        for i in 0..q.len() {
            q[i] += h * weight / 6.0 * slope_q[i];
            qd[i] += h * weight / 6.0 * slope_qd[i];
        }
    }
}

#[test]
fn power_of_the_torques_is_the_change_of_energy() {
    // With prismatic joints: only they have the Coriolis term of a moving link.
    let mut sampler = Sampler::new(35);
    let mut arms = vec![ChainDynamics::new(&Chain::iiwa14()).unwrap()];
    arms.extend((2..=8).map(|n| random_dynamics(&mut sampler, n, 0.5)));
    for arm in &arms {
        let n = arm.chain().joint_count();
        let q = random_q(arm.chain(), &mut sampler);
        let qd = uniform(&mut sampler, n, 1.0);
        let torques = uniform(&mut sampler, n, 40.0);
        let power: f64 = torques.iter().zip(&qd).map(|(a, b)| a * b).sum();
        let total = |h: f64| {
            let (mut q, mut qd) = (q.clone(), qd.clone());
            step(arm, &mut q, &mut qd, &torques, h);
            arm.kinetic_energy_j(&q, &qd).unwrap() + arm.potential_energy_j(&q).unwrap()
        };
        let change = central_difference(total, 0.0, 1e-5);
        assert_close!(change, power, Tol::new(1e-4, 1e-5));
    }
}

#[test]
fn payload_adds_its_weight() {
    let chain = Chain::iiwa7();
    let (centre_m, size_m) = (DVec3::new(0.0, 0.02, 0.05), DVec3::new(0.3, 0.4, 0.02));
    let board = Inertial::solid_box("board", 1.5, centre_m, size_m);
    let bare = ChainDynamics::new(&chain).unwrap();
    let loaded = bare.clone().with_payload(&board).unwrap();
    let q = [0.3, -0.5, 0.7, 1.1, -0.2, 0.4, 0.9];
    let with_board = chain.with_tip(chain.link_from_tip() * shift(0.0, 0.02, 0.05));
    let jacobian = with_board.jacobian(&q).unwrap();
    let weight = Wrench {
        force_n: -1.5 * GRAVITY_M_PER_S2,
        moment_n_m: DVec3::ZERO,
    };
    let added = jacobian.torques(&weight);
    let before = bare.gravity_torque(&q).unwrap();
    let expected: Vec<f64> = before.iter().zip(&added).map(|(a, b)| a + b).collect();
    let after = loaded.gravity_torque(&q).unwrap();
    assert_close!(after, expected, Tol::abs(1e-12));

    // The mass matrix grows by Jᵀ diag(m, I) J at the board's centre.
    let rotation = with_board.forward(&q).unwrap().rotation();
    let inertia = rotation * board.inertia_kg_m2 * rotation.transpose();
    let [before, after] = [&bare, &loaded].map(|arm| arm.mass_matrix(&q).unwrap());
    for i in 0..7 {
        for j in 0..7 {
            let [a, b] = [i, j].map(|k| jacobian.columns[k]);
            let part = |c: [f64; 6]| (DVec3::from_slice(&c[..3]), DVec3::from_slice(&c[3..]));
            let ((va, wa), (vb, wb)) = (part(a), part(b));
            let grown = board.mass_kg * va.dot(vb) + wa.dot(inertia * wb);
            assert_close!(after[i * 7 + j] - before[i * 7 + j], grown, Tol::abs(1e-13));
        }
    }
}

#[test]
fn one_slide_lifts_its_mass() {
    let joint = ChainJoint {
        inertials: vec![Inertial::point("load", 3.0, DVec3::new(0.1, 0.2, 0.3))],
        ..ChainJoint::prismatic("lift", Pose::IDENTITY, DVec3::Z, JointLimit::new(0.0, 1.0))
    };
    let arm = ChainDynamics::new(&Chain::new(vec![joint], Pose::IDENTITY).unwrap()).unwrap();
    let force = arm.inverse(&[0.5], &[1.0], &[2.0]).unwrap();
    assert_close!(force, [3.0 * (9.81 + 2.0)], Tol::abs(1e-13));
    let energy = arm.potential_energy_j(&[0.5]).unwrap();
    assert_close!(energy, 3.0 * 9.81 * 0.8, Tol::abs(1e-13));
}

#[test]
fn into_forms_agree_and_scratch_of_another_chain_is_replaced() {
    let arm = ChainDynamics::new(&Chain::iiwa7()).unwrap();
    let mut sampler = Sampler::new(36);
    let mut scratch = random_dynamics(&mut sampler, 3, 0.0).scratch();
    let q = random_q(arm.chain(), &mut sampler);
    let (qd, third) = (uniform(&mut sampler, 7, 1.0), uniform(&mut sampler, 7, 3.0));
    let (mut out, mut matrix) = ([0.0; 7], [0.0; 49]);
    for _ in 0..2 {
        arm.forward_into(&q, &qd, &third, &mut scratch, &mut out)
            .unwrap();
        assert_eq!(out.to_vec(), arm.forward(&q, &qd, &third).unwrap());
        arm.inverse_into(&q, &qd, &third, &mut scratch, &mut out)
            .unwrap();
        assert_eq!(out.to_vec(), arm.inverse(&q, &qd, &third).unwrap());
        arm.gravity_torque_into(&q, &mut scratch, &mut out).unwrap();
        assert_eq!(out.to_vec(), arm.gravity_torque(&q).unwrap());
        arm.mass_matrix_into(&q, &mut scratch, &mut matrix).unwrap();
        assert_eq!(matrix.to_vec(), arm.mass_matrix(&q).unwrap());
    }
    let short = arm.gravity_torque_into(&q, &mut scratch, &mut [0.0; 6]);
    assert!(short.is_err());
    let short = arm.mass_matrix_into(&q, &mut scratch, &mut [0.0; 7]);
    assert!(short.is_err());
}

#[test]
fn bad_bodies_and_numbers_are_errors() {
    let with = |inertial: Inertial| {
        let mut joint = ChainJoint::revolute("a", Pose::IDENTITY, DVec3::Z, JointLimit::FREE);
        joint.inertials.push(inertial);
        ChainDynamics::new(&Chain::new(vec![joint], Pose::IDENTITY).unwrap())
    };
    let body = |mass, six| Inertial::from_six("link", mass, DVec3::X, six);
    let bad = |mass_kg| {
        Err(KinematicsError::Inertia {
            link: "link".into(),
            mass_kg,
        })
    };
    let diagonal = |xx, yy, zz| [xx, 0.0, 0.0, yy, 0.0, zz];
    for (six, what) in [
        (diagonal(0.1, 0.1, 0.1), "a ball"),
        ([0.0; 6], "a point mass"),
        (diagonal(0.1, 0.1, 0.2), "a flat plate is the limit"),
    ] {
        assert!(with(body(1.0, six)).is_ok(), "{what}");
    }
    let mut lopsided = body(1.0, diagonal(0.1, 0.1, 0.1));
    lopsided.inertia_kg_m2.x_axis.y = 0.05;
    for (inertial, what) in [
        (body(-1.0, diagonal(0.1, 0.1, 0.1)), "negative mass"),
        (body(0.0, diagonal(0.1, 0.1, 0.1)), "no mass"),
        (body(1.0, diagonal(-0.1, 0.1, 0.1)), "negative"),
        (body(1.0, diagonal(0.1, 0.1, 0.3)), "triangle inequality"),
        (body(1.0, [0.1, 0.2, 0.0, 0.1, 0.0, 0.1]), "negative moment"),
        (lopsided, "asymmetric"),
    ] {
        let mass_kg = inertial.mass_kg;
        assert_eq!(with(inertial), bad(mass_kg), "{what}");
    }
    for inertial in [body(f64::NAN, [0.0; 6]), body(1.0, [f64::NAN; 6])] {
        let error = with(inertial).unwrap_err();
        assert!(matches!(error, KinematicsError::Argument(_)), "{error}");
    }
    assert_eq!(with(body(0.0, [0.0; 6])), Err(KinematicsError::NoInertials));
    assert_eq!(
        ChainDynamics::new(&franka()),
        Err(KinematicsError::NoInertials)
    );

    let arm = ChainDynamics::new(&Chain::iiwa7()).unwrap();
    let (zero, nan) = ([0.0; 7], [f64::NAN; 7]);
    assert!(arm.gravity_torque(&nan).is_err());
    assert!(arm.inverse(&zero, &nan, &zero).is_err());
    assert!(arm.inverse(&zero, &zero, &nan).is_err());
    assert!(arm.inverse(&zero, &zero, &[0.0; 6]).is_err());
    assert!(arm.forward(&zero, &zero, &nan).is_err());
    assert!(arm.inverse(&nan, &zero, &zero).is_err());
    assert!(arm.mass_matrix(&[]).is_err());
    assert!(arm.kinetic_energy_j(&zero, &nan).is_err());
    assert!(arm.potential_energy_j(&nan).is_err());
    let fast = [1e200; 7];
    assert!(arm.inverse(&[0.5; 7], &fast, &zero).is_err());
    assert!(arm.kinetic_energy_j(&[0.5; 7], &fast).is_err());
    assert!(arm.clone().with_gravity(DVec3::NAN).is_err());
    assert!(arm.with_payload(&body(-1.0, [0.0; 6])).is_err());
}

#[test]
fn a_joint_without_mass_has_no_forward_dynamics() {
    let joint = |name: &str, inertials| ChainJoint {
        inertials,
        ..ChainJoint::revolute(name, shift(0.0, 0.0, 0.5), DVec3::Y, JointLimit::FREE)
    };
    let joints = vec![
        joint("arm", vec![Inertial::point("ball", 1.0, DVec3::X)]),
        joint("pen", vec![]),
    ];
    let arm = ChainDynamics::new(&Chain::new(joints, Pose::IDENTITY).unwrap()).unwrap();
    assert!(arm.inverse(&[0.1, 0.2], &[0.0; 2], &[1.0; 2]).is_ok());
    let error = arm.forward(&[0.1, 0.2], &[0.0; 2], &[0.0; 2]);
    assert_eq!(error, Err(KinematicsError::SingularMass { joint: 1 }));
}

/// A pendulum of 2 kg at 0.5 m on a level axis: inertia 0.5 kg m², gravity torque at most 9.8 N m.
#[test]
fn accelerations_of_a_description_without_any_follow_from_torque_and_inertia() {
    let arm = |inertial: &str, limit: &str| {
        let text = format!(
            r#"<robot name="r"><link name="base"/><link name="l">{inertial}</link>
            <joint name="a" type="revolute"><parent link="base"/><child link="l"/><axis xyz="0 1 0"/>
            <limit lower="-3" upper="3" {limit}/></joint></robot>"#
        );
        Chain::from_urdf_str(&text, None, None).unwrap()
    };
    let body = r#"<inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let strong = arm(body, r#"velocity="3" effort="20""#);
    let found = strong.estimated_accelerations(None);
    assert!(found.is_computed);
    let exact = (20.0 - 2.0 * 9.80665 * 0.5) / 0.5;
    assert_close!(found.rad_per_s2[0], exact, Tol::abs(0.01 * exact));
    // A payload slows it down; without masses the time is assumed.
    let load = Inertial::solid_box("load", 0.5, DVec3::X * 0.5, DVec3::splat(0.01));
    let loaded = strong.estimated_accelerations(Some(&load));
    assert!(loaded.rad_per_s2[0] < found.rad_per_s2[0]);
    let assumed = arm("", r#"velocity="2" effort="20""#).estimated_accelerations(None);
    assert!(!assumed.is_computed && (assumed.rad_per_s2[0] - 2.0 / 0.3).abs() < 1e-9);
    // A placeholder brakes no arm at once, and a joint that cannot hold its link is slow.
    for (effort, full_speed_s) in [(1e6, 0.1), (5.0, 1.0)] {
        let limit = format!(r#"velocity="2" effort="{effort}""#);
        let found = arm(body, &limit).estimated_accelerations(None);
        assert_eq!(found.full_speed_s, full_speed_s);
    }
}
