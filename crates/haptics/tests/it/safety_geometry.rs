//! Capsules, contact limits, pushes at the edge.

use glam::DVec3;
use hwall_haptics::body::{ArmBody, ArmPart, BodyConfig, Capsule, LeftOut};
use hwall_haptics::safety::{BoardLoad, ContactLimits, LoadLimits, WorkspaceBox};
use hwall_haptics::{Board, board_pose};
use hwall_kinematics::{ArmKinematics, Chain, ChainArm, JointPositions, SrsArm, Wrench};
use hwall_testkit::{Sampler, Tol, assert_close, refused};
use std::sync::Arc;

fn capsule(from_m: DVec3, to_m: DVec3, radius_m: f64) -> Capsule {
    Capsule {
        from_m,
        to_m,
        radius_m,
    }
}

/// For a fixed point of one segment the nearest point of the other is known, and the distance is convex along the first.
fn searched_m(a: &Capsule, b: &Capsule) -> f64 {
    let to_b = |s: f64| {
        let p = a.from_m.lerp(a.to_m, s);
        let v = b.to_m - b.from_m;
        // A point has no direction.
        let t = (p - b.from_m).dot(v) / v.length_squared().max(f64::MIN_POSITIVE);
        p.distance(b.from_m + v * t.clamp(0.0, 1.0))
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let third = (high - low) / 3.0;
        if to_b(low + third) < to_b(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    to_b(0.5 * (low + high)).min(to_b(0.0)).min(to_b(1.0)) - a.radius_m - b.radius_m
}

#[test]
fn distances_agree_with_a_search() {
    let mut s = Sampler::new(5);
    let corner = DVec3::splat(0.5);
    for i in 0..20_000 {
        let mut point = || s.point_in_box(-corner, corner);
        let (p0, mut p1, q0, mut q1) = (point(), point(), point(), point());
        match i % 5 {
            // Parallel, nearly parallel, points, crossing.
            1 => q1 = q0 + (p1 - p0) * 0.7,
            2 => q1 = q0 + (p1 - p0) * 0.7 + point() * 1e-9,
            3 => p1 = p0,
            4 => q1 = q0 + 2.0 * (p0.lerp(p1, 0.4) - q0),
            _ => {}
        }
        let (a, b) = (capsule(p0, p1, 0.03), capsule(q0, q1, 0.05));
        let (found, searched) = (a.distance_m(&b), searched_m(&a, &b));
        assert!((found - searched).abs() < 1e-7, "{i}: {found} {searched}");
        assert!(found <= searched + 1e-12, "{i}: {found} {searched}");
        assert!((found - b.distance_m(&a)).abs() < 1e-12);
    }
    let p = capsule(DVec3::ZERO, DVec3::ZERO, 0.1);
    assert!((p.distance_m(&p) + 0.2).abs() < 1e-15);
    assert!(p.distance_m(&capsule(DVec3::NAN, DVec3::X, 0.1)).is_nan());
}

fn body(arm: Arc<dyn ArmKinematics>) -> ArmBody {
    let board = Board::default();
    let arm = arm.carrying(board.flange_from_board_face().unwrap());
    ArmBody::new(arm, board, BodyConfig::default()).unwrap()
}

/// Base, shoulder, elbow, wrist, face from the axes; the chain has its joints in between, on the same lines.
#[test]
fn the_bodies_of_closed_form_and_chain_are_the_same() {
    let q = JointPositions::from_deg([20.0, 40.0, -10.0, -80.0, 30.0, 50.0, 15.0]);
    let srs = body(Arc::new(SrsArm::iiwa7()));
    let chain = body(Arc::new(ChainArm::new(Chain::iiwa7()).unwrap()));
    let at = srs.at(&q);
    let lengths_m = at.links().iter().map(|c| c.from_m.distance(c.to_m));
    let lengths_m: Vec<f64> = lengths_m.collect();
    let face_m = srs.arm().forward(&q).position_m();
    let tool_m = face_m.distance(at.links()[3].from_m);
    assert_close!(lengths_m, [0.34, 0.4, 0.4, tool_m], Tol::abs(1e-9));
    let mut sampler = Sampler::new(7);
    for _ in 0..200 {
        let at_m = sampler.point_in_box(-DVec3::ONE, DVec3::ONE);
        let ball = capsule(at_m, at_m, 0.1);
        let [a, b] = [&srs, &chain].map(|body| body.at(&q).distance_m(&ball));
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

const UR5: &str = include_str!("../../../kinematics/tests/data/ur5.urdf");
const UR5_UPRIGHT: [f64; 7] = [0.0, -90.0, 60.0, 0.0, 90.0, 0.0, 0.0];
const UR5_FOLDED: [f64; 7] = [0.0, -90.0, 165.0, 0.0, 90.0, 0.0, 0.0];

/// The check must be able to run: it runs for all arms, and their nominal posture is free.
#[test]
fn a_folded_arm_meets_itself() {
    let urdf = |text: &str| Chain::from_urdf_str(text, None, None).unwrap();
    let panda = include_str!("../../../kinematics/tests/data/panda.urdf");
    let endless = panda.replace("revolute", "continuous");
    let panda_upright = [0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0];
    let panda_folded = [0.0, 80.0, 0.0, -174.0, 0.0, 90.0, 0.0];
    let iiwa_folded = [0.0, 100.0, 0.0, -119.0, 0.0, 115.0, 0.0];
    for (chain, upright, folded) in [
        (Chain::iiwa7(), [0.0; 7], iiwa_folded),
        (urdf(UR5), UR5_UPRIGHT, UR5_FOLDED),
        (urdf(panda), panda_upright, panda_folded),
        (urdf(&endless), panda_upright, panda_folded),
    ] {
        let mut body = body(Arc::new(ChainArm::new(chain).unwrap()));
        body.fit(&JointPositions::from_deg(upright));
        let [free_m, met_m] =
            [upright, folded].map(|deg| body.nearest(&JointPositions::from_deg(deg)).distance_m);
        assert!(free_m > body.clearance_m(), "{free_m}");
        assert!(met_m < body.clearance_m() && met_m.is_finite(), "{met_m}");
        let nowhere = body.nearest(&JointPositions([f64::NAN; 7]));
        assert!(nowhere.distance_m.is_nan());
    }
}

/// A posture in which parts overlap is taken to be free: these parts, and no others, are left out, and that is told.
#[test]
fn parts_that_overlap_where_the_arm_begins_are_left_out_and_told() {
    let arm = ChainArm::new(Chain::from_urdf_str(UR5, None, None).unwrap()).unwrap();
    let [upright, folded] = [UR5_UPRIGHT, UR5_FOLDED].map(JointPositions::from_deg);
    let mut body = body(Arc::new(arm));
    body.fit(&upright);
    assert_eq!(body.left_out().count(), 0);
    body.fit(&folded);
    let told: Vec<_> = body.left_out().collect();
    assert!(!told.is_empty());
    let capsules = body.at(&folded);
    let index = |part| match part {
        ArmPart::Link(link) => link,
        ArmPart::Board { strip } => capsules.links().len() + strip,
    };
    for LeftOut(parts) in &told {
        let [one, other] = parts.map(|part| capsules.all()[index(part)]);
        assert!(one.distance_m(&other) <= body.clearance_m(), "{parts:?}");
    }
    // Everything else is still checked, and clear here.
    assert!(body.nearest(&folded).distance_m > body.clearance_m());
    let said = told[0].to_string();
    let names_both = said.starts_with("link ") && said.contains(" and ");
    assert!(names_both, "{said}");
}

#[test]
fn speed_caps_follow_two_masses_on_a_spring() {
    let limits = ContactLimits::default();
    limits.validate().unwrap();
    for mass in [0.1, 1.0, 5.0, 20.0, f64::INFINITY] {
        let cap = limits.speed_cap_m_per_s(mass).unwrap();
        let mu = limits.reduced_mass_kg(mass);
        assert!(mu <= limits.hand_mass_kg);
        // The peak force of the impact, and its energy.
        let force = cap * (mu * limits.hand_stiffness_n_per_m).sqrt();
        let energy = 0.5 * mu * cap * cap;
        assert!(force <= limits.impact_force_n() + 1e-9 && energy <= limits.energy_j + 1e-9);
        let at_a_limit = (force - limits.impact_force_n()).abs() < 1e-9
            || (energy - limits.energy_j).abs() < 1e-9;
        assert!(at_a_limit);
    }
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(limits.speed_cap_m_per_s(bad).is_err());
    }
    // A needle causes more pressure than a palm.
    let needle = ContactLimits {
        contact_area_m2: 1e-6,
        ..limits
    };
    assert!((needle.lasting_force_n() - 1.9).abs() < 1e-12);
    assert_eq!(limits.lasting_force_n(), 140.0);
    assert_eq!(limits.impact_force_n(), 280.0);
    refused!(limits, |limits: ContactLimits| limits.validate(), {
        quasi_static_n = f64::NAN;
        transient_n = 100.0;
        energy_j = 0.0;
        transient_pressure_factor = 0.5;
        implausible_n = 10.0;
    });
}

#[test]
fn a_push_is_found_where_it_acts() {
    let board = Board::default();
    let limits = LoadLimits::default();
    let pose = board_pose(DVec3::new(0.5, 0.1, 0.6), DVec3::new(1.0, 0.2, -0.1), 0.3).unwrap();
    for (x, y, at_edge) in [
        (0.0, 0.0, false),
        (0.05, -0.09, false),
        (0.097, 0.0, true),
        (0.0, -0.12, true),
    ] {
        let point = pose.transform_point(DVec3::new(x, y, 0.0));
        let force_n = pose.transform_vector(DVec3::new(1.0, 2.0, -30.0));
        let wrench = Wrench {
            force_n,
            moment_n_m: (point - pose.position_m()).cross(force_n),
        };
        let load = BoardLoad::new(&pose, &wrench);
        assert!((load.normal_n - 30.0).abs() < 1e-9);
        assert!((load.centre_m[0] - x).abs() < 1e-9 && (load.centre_m[1] - y).abs() < 1e-9);
        assert_eq!(load.exceeds(&limits, &board), at_edge, "{x} {y}");
    }
    let nothing = BoardLoad::new(&pose, &Wrench::default());
    assert!(!nothing.exceeds(&limits, &board));
    let heavy = Wrench {
        moment_n_m: DVec3::Y * 20.0 + DVec3::Z * 9.0,
        ..Wrench::default()
    };
    assert!(BoardLoad::new(&pose, &heavy).exceeds(&limits, &board));
}

#[test]
fn a_box_holds_what_is_inside() {
    let inside = WorkspaceBox {
        min_m: DVec3::splat(-1.0),
        max_m: DVec3::ONE,
    };
    inside.validate().unwrap();
    assert!(inside.contains(DVec3::ZERO) && inside.contains(DVec3::ONE));
    assert!(!inside.contains(DVec3::NAN));
    for out_m in DVec3::AXES
        .into_iter()
        .flat_map(|axis| [-1.1 * axis, 1.1 * axis])
    {
        assert!(!inside.contains(out_m), "{out_m}");
    }
    for max_m in [DVec3::splat(-2.0), DVec3::NAN] {
        assert!(WorkspaceBox { max_m, ..inside }.validate().is_err());
    }
}
