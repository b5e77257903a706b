//! Moving objects under a board: an arm that executes commands at once, and bad input.

use crate::support::{at_rest, before_door as start, force, iiwa, positions};
use hwall_haptics::glam::DVec3;
use hwall_haptics::{
    ArmCommand, MovingObject, ObjectCommand, ObjectConfig, ObjectPath, ObjectRendering,
    ObjectRenderingConfig, RenderedObject,
};
use hwall_kinematics::{ArmKinematics, Chain, ChainDynamics, JointPositions, Unreachable, Wrench};
use hwall_testkit::{Tol, assert_close, refused};
use std::sync::Arc;

const PERIOD_S: f64 = 1e-3;

fn arm() -> Arc<dyn ArmKinematics> {
    Arc::new(iiwa())
}

fn torque() -> ObjectCommand {
    ObjectCommand::Torque {
        dynamics: Box::new(ChainDynamics::new(&Chain::iiwa7()).unwrap()),
        config: Default::default(),
    }
}

fn panel(config: ObjectConfig) -> RenderedObject {
    let inward = -arm().forward(&start()).rotation().z_axis;
    RenderedObject {
        object: MovingObject::new(config).unwrap(),
        path: ObjectPath::sliding(inward).unwrap(),
    }
}

fn door(config: ObjectConfig) -> RenderedObject {
    let face = arm().forward(&start());
    let inward = -face.rotation().z_axis;
    let beside = DVec3::Z.cross(inward).normalize();
    let hinge_m = face.position_m() - 0.6 * beside;
    RenderedObject {
        object: MovingObject::new(config).unwrap(),
        path: ObjectPath::turning(hinge_m, beside.cross(inward)).unwrap(),
    }
}

fn rendering(command: ObjectCommand) -> ObjectRendering {
    ObjectRendering::new(arm(), command, ObjectRenderingConfig::default()).unwrap()
}

/// Against the normal of the face.
fn push(q: &JointPositions, force_n: f64) -> Wrench {
    force(-arm().forward(q).rotation().z_axis * force_n)
}

/// One period of an arm at rest at the start, pushed there.
fn pushed(rendering: &mut ObjectRendering, rendered: &mut RenderedObject) -> Option<f64> {
    let (state, wrench) = (at_rest(0.0, start()), push(&start(), 1.0));
    let step = rendering.step(rendered, &state, &wrench, PERIOD_S).unwrap();
    step.raised_inertia
}

/// Positions of the face, one for each period, of an arm that executes commands at once.
fn followed(rendered: &mut RenderedObject, force_n: f64, steps: usize) -> Vec<JointPositions> {
    let mut rendering = rendering(ObjectCommand::Position);
    rendering.begin(rendered, &start()).unwrap();
    let mut q = start();
    (0..steps)
        .map(|_| {
            let wrench = push(&q, force_n);
            let step = rendering
                .step(rendered, &at_rest(0.0, q), &wrench, PERIOD_S)
                .unwrap();
            if let ArmCommand::Position(next) = step.command {
                q = next;
            }
            q
        })
        .collect()
}

#[test]
fn the_face_stays_on_the_path_and_ends_where_the_spring_holds() {
    let config = ObjectConfig {
        stiffness: 300.0,
        damping: 60.0,
        ..ObjectConfig::new(5.0)
    };
    let mut rendered = panel(config);
    let first = arm().forward(&start());
    let path = rendered.path;
    let way = followed(&mut rendered, 12.0, 3000);
    for q in &way {
        let now = arm().forward(q);
        let along = (now.position_m() - first.position_m()).dot(-first.rotation().z_axis);
        let apart = path.moved(&first, along).distance(&now);
        let on_path = apart.position_m < 1e-6 && apart.angle_rad < 1e-6;
        assert!(on_path, "{apart:?}");
    }
    let last_m = arm().forward(way.last().unwrap()).position_m();
    let way_m = last_m.distance(first.position_m());
    assert_close!(way_m, 12.0 / 300.0, Tol::abs(1e-4));
}

#[test]
fn a_door_turns_the_board() {
    let config = ObjectConfig {
        stiffness: 30.0,
        damping: 20.0,
        ..ObjectConfig::new(4.3)
    };
    let mut rendered = door(config);
    let first = arm().forward(&start());
    let way = followed(&mut rendered, 10.0, 6000);
    let now = arm().forward(way.last().unwrap());
    let angle_rad = rendered.object.position();
    assert_close!(angle_rad, 10.0 * 0.6 / 30.0, Tol::abs(1e-4));
    let apart = rendered.path.moved(&first, angle_rad).distance(&now);
    let turned = apart.position_m < 1e-4 && apart.angle_rad < 1e-4;
    assert!(turned, "{apart:?}");
}

#[test]
fn joints_keep_their_speeds_and_accelerations() {
    let mut rendered = panel(ObjectConfig::new(4.0));
    let way = followed(&mut rendered, 60.0, 400);
    let speeds = *arm().max_velocity_rad_per_s();
    let limits = ObjectRenderingConfig::default().max_acceleration_rad_per_s2;
    for three in way.windows(3) {
        for i in 0..7 {
            let speed = (three[2][i] - three[1][i]) / PERIOD_S;
            let before = (three[1][i] - three[0][i]) / PERIOD_S;
            assert!(speed.abs() <= speeds[i]);
            // The path is not straight in the joints.
            let excess = (speed - before).abs() / PERIOD_S - limits[i];
            assert!(excess < 0.5 * limits[i], "joint {i}: {excess}");
        }
    }
}

#[test]
fn what_the_arm_cannot_reach_holds_the_object_back() {
    // Pulled out of reach.
    let mut rendered = panel(ObjectConfig {
        damping: 5.0,
        ..ObjectConfig::new(5.0)
    });
    let mut rendering = rendering(ObjectCommand::Position);
    rendering.begin(&mut rendered, &start()).unwrap();
    let (mut q, mut reasons) = (start(), Vec::<Unreachable>::new());
    for _ in 0..5000 {
        let before_j = rendered.object.energy_j();
        let wrench = push(&q, -15.0);
        let step = rendering
            .step(&mut rendered, &at_rest(0.0, q), &wrench, PERIOD_S)
            .unwrap();
        if let Some(reason) = step.unreachable {
            assert!(rendered.object.energy_j() <= before_j);
            reasons.push(reason);
        }
        let next = positions(step.command);
        assert!(next.max_abs_difference(&q) < 0.01);
        q = next;
    }
    assert!(!reasons.is_empty());
    assert!(rendered.object.position() > -0.6);
}

#[test]
fn light_objects_are_made_heavier_and_the_step_says_so() {
    for (command, least, most) in [(ObjectCommand::Position, 2.0, 5.0), (torque(), 0.5, 3.0)] {
        let mut rendered = panel(ObjectConfig::new(0.05));
        let mut rendering = rendering(command);
        rendering.begin(&mut rendered, &start()).unwrap();
        let bound = rendering.least_inertia(&rendered);
        assert!((least..most).contains(&bound), "{bound}");
        assert_eq!(pushed(&mut rendering, &mut rendered), Some(bound));
        assert_eq!(rendered.object.inertia(), bound);
        assert_eq!(rendered.object.config().inertia, 0.05);

        let mut heavy = panel(ObjectConfig::new(10.0));
        rendering.begin(&mut heavy, &start()).unwrap();
        assert_eq!(pushed(&mut rendering, &mut heavy), None);
        assert_eq!(heavy.object.inertia(), 10.0);
    }
}

#[test]
fn a_raised_inertia_is_that_of_a_heavier_object() {
    let config = ObjectConfig {
        stiffness: 400.0,
        damping: 3.0,
        range: [0.0, 0.02],
        ..ObjectConfig::new(0.05)
    };
    let mut raised = MovingObject::new(config.clone()).unwrap();
    raised.raise_inertia(2.0).unwrap();
    raised.raise_inertia(1.0).unwrap();
    // The damping ratio stays.
    let mut heavy = MovingObject::new(ObjectConfig {
        inertia: 2.0,
        damping: (2.0_f64 / config.inertia).sqrt() * config.damping,
        ..config
    })
    .unwrap();
    for k in 0..2000 {
        let force = if k < 500 { 5.0 } else { 0.0 };
        let ahead = raised.after(force, PERIOD_S).unwrap();
        raised.step(force, PERIOD_S).unwrap();
        heavy.step(force, PERIOD_S).unwrap();
        assert_eq!(ahead, (raised.position(), raised.velocity()));
        assert_eq!(raised.position(), heavy.position());
        assert_eq!(raised.energy_j(), heavy.energy_j());
    }
    // Restored in motion it loses energy; from then on it is the configured object.
    raised.step(5.0, 0.01).unwrap();
    let (before_j, at) = (raised.energy_j(), raised.position());
    raised.restore_inertia();
    assert!(raised.energy_j() < before_j && raised.position() == at);
    assert_eq!(raised.inertia(), 0.05);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(raised.raise_inertia(bad).is_err());
    }
}

#[test]
fn bad_input_is_named_and_changes_nothing() {
    for command in [ObjectCommand::Position, torque()] {
        let mut rendered = panel(ObjectConfig::new(5.0));
        let mut rendering = rendering(command);
        rendering.begin(&mut rendered, &start()).unwrap();
        let good = push(&start(), 5.0);
        let bad_wrench = force(DVec3::new(f64::NAN, 0.0, 0.0));
        let mut bad_state = at_rest(0.0, start());
        bad_state.q[3] = f64::NAN;
        let before = rendered.object.position();
        for (state, wrench, dt_s) in [
            (at_rest(0.0, start()), bad_wrench, PERIOD_S),
            (bad_state, good, PERIOD_S),
            (at_rest(0.0, start()), good, 0.0),
            (at_rest(0.0, start()), good, f64::NAN),
        ] {
            let answer = rendering.step(&mut rendered, &state, &wrench, dt_s);
            assert!(answer.is_err());
            assert_eq!(rendered.object.position(), before);
            assert_eq!(rendered.object.velocity(), 0.0);
        }
        let nowhere = JointPositions([f64::NAN; 7]);
        assert!(rendering.begin(&mut rendered, &nowhere).is_err());
        pushed(&mut rendering, &mut rendered);
    }
    let make = |config| ObjectRendering::new(arm(), ObjectCommand::Position, config);
    refused!(ObjectRenderingConfig::default(), make, {
        filter_s = f64::NAN;
        motion_delay_s = Some(-1.0);
        max_acceleration_rad_per_s2 = [0.0; 7];
    });
}

#[test]
fn steps_do_not_allocate() {
    for command in [ObjectCommand::Position, torque()] {
        let mut rendered = door(ObjectConfig {
            stiffness: 20.0,
            damping: 5.0,
            range: [0.0, 0.1],
            ..ObjectConfig::new(4.0)
        });
        let mut rendering = rendering(command);
        let (there, back) = (push(&start(), 20.0), push(&start(), -20.0));
        let allocated = allocation_counter::measure(|| {
            rendering.begin(&mut rendered, &start()).unwrap();
            for k in 0..500 {
                let wrench = if k < 300 { there } else { back };
                let q = *rendering.q();
                rendering
                    .step(&mut rendered, &at_rest(0.0, q), &wrench, PERIOD_S)
                    .unwrap();
            }
        });
        assert_eq!(allocated.count_total, 0);
    }
}
