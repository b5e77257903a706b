//! Whatever the room and the targets, no command leaves the limits of the arm.

use glam::{DAffine3, DVec3};
use hwall_haptics::{
    Arm, ArmCommand, Board, BoardTarget, FollowerConfig, Phase, Renderer, RendererConfig,
};
use hwall_kinematics::{JointPositions, SrsArm, Wrench};
use hwall_scene::Scene;
use hwall_sim::{ServoArm, ServoConfig};
use hwall_testkit::Sampler;

const DT_S: f64 = 1e-3;
const STEPS: usize = 4000;

/// Two walls and a box, anywhere around the arm, turned at random about the vertical.
fn room(s: &mut Sampler) -> Scene {
    let mut obj = String::new();
    let mut vertices = 0;
    let mut quad = |name: &str, corners: [DVec3; 4]| {
        obj += &format!("o {name}\n");
        for c in corners {
            obj += &format!("v {} {} {}\n", c.x, c.y, c.z);
        }
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| vertices + i);
        obj += &format!("f {a} {b} {c} {d}\n");
        vertices += 4;
    };
    for name in ["front", "side"] {
        let turned = DAffine3::from_rotation_z(s.uniform(-1.5, 1.5));
        let x = s.uniform(0.35, 1.1);
        let lean = s.uniform(-0.2, 0.2);
        let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.6), (-1.0, 1.6)];
        quad(
            name,
            corners.map(|(y, z)| turned.transform_point3(DVec3::new(x + lean * z, y, z))),
        );
    }
    let (x, z) = (s.uniform(0.4, 0.8), s.uniform(0.2, 0.8));
    let corners = [(0.0, -0.3), (0.3, -0.3), (0.3, 0.3), (0.0, 0.3)];
    quad("shelf", corners.map(|(dx, y)| DVec3::new(x + dx, y, z)));
    Scene::from_obj_str(&obj, None).expect("a room").0
}

#[test]
fn no_command_leaves_the_limits_in_20_random_rooms() {
    let (mut reached, mut refused, mut held, mut touched) = (0, 0, 0, 0);
    for seed in 0..20 {
        let mut s = Sampler::new(100 + seed);
        let scene = room(&mut s);
        let mut renderer = Renderer::new(
            &SrsArm::iiwa7(),
            &Board::default(),
            RendererConfig::default(),
        )
        .unwrap();
        let arm = renderer.arm().clone();
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let mut servo = ServoArm::new(
            arm.clone(),
            start,
            ServoConfig {
                seed,
                ..ServoConfig::default()
            },
        )
        .unwrap();
        let follower = FollowerConfig::default();
        let mut before: Option<(JointPositions, [f64; 7])> = None;
        let mut target = None;
        for i in 0..STEPS {
            let now_s = i as f64 * DT_S;
            if s.uniform(0.0, 1.0) < 0.0015 {
                // A place on the room, or none at all.
                let near_m = s.point_in_box(DVec3::new(-0.2, -0.9, 0.0), DVec3::new(0.9, 0.9, 1.3));
                let found = scene.closest_touchable(near_m, 0.5).unwrap();
                target = found.map(|c| (c.point_m, c.normal));
                let press = if s.index(4) == 0 {
                    s.unit_vector() * s.uniform(0.0, 15.0)
                } else {
                    DVec3::ZERO
                };
                servo
                    .apply_wrench(Wrench {
                        force_n: press,
                        ..Wrench::default()
                    })
                    .unwrap();
            }
            if let Some((point_m, _)) = &mut target {
                // A hand that drifts.
                *point_m += s.unit_vector() * 5e-4;
            }
            let aim = target.map(|(point_m, normal)| BoardTarget {
                point_m,
                normal,
                stamp_s: now_s,
                roll_rad: None,
            });
            let state = servo.state().unwrap();
            let step = renderer.step(now_s, &state, aim.as_ref());
            let ArmCommand::Position(q) = step.command else {
                panic!("all states are good: {step:?}")
            };
            let mut speed = [0.0; 7];
            for j in 0..7 {
                assert!(
                    q[j].is_finite() && arm.limits()[j].contains(q[j]),
                    "{seed} {i} {j}: {}",
                    q[j]
                );
                let Some((before, speed_before)) = before else {
                    continue;
                };
                speed[j] = (q[j] - before[j]) / DT_S;
                let most = follower.speed_share * arm.max_velocity_rad_per_s()[j];
                assert!(
                    speed[j].abs() <= most + 1e-9,
                    "{seed} {i} {j}: {} rad/s",
                    speed[j]
                );
                let change = (speed[j] - speed_before[j]) / DT_S;
                let most = follower.acceleration_rad_per_s2[j];
                assert!(
                    change.abs() <= most + 1e-6,
                    "{seed} {i} {j}: {change} rad/s²"
                );
            }
            before = Some((q, speed));
            servo.command(step.command).unwrap();
            servo.advance(DT_S).unwrap();
            for j in 0..7 {
                assert!(
                    arm.limits()[j].contains(servo.q()[j]),
                    "{seed} {i} {j}: {}",
                    servo.q()[j]
                );
                assert!(servo.qd()[j].abs() <= arm.max_velocity_rad_per_s()[j] + 1e-12);
            }
            let arrived = step
                .goal
                .is_some_and(|goal| servo.q().max_abs_difference(&goal) < 0.05);
            reached += usize::from(arrived && step.unreachable.is_none() && aim.is_some());
            touched += usize::from(matches!(step.phase, Phase::Contact { .. }));
            refused += usize::from(step.unreachable.is_some());
            held += usize::from(aim.is_none());
        }
    }
    // The rooms must offer all of it.
    let counts = [reached, refused, held, touched];
    assert!(
        counts.iter().all(|n| *n > 2000),
        "at the goal, out of reach, no target, touched: {counts:?}"
    );
    println!("at the goal, out of reach, no target, touched: {counts:?} steps");
}
