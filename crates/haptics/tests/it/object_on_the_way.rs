//! A hand that meets the board on its path to a door.

use crate::support::{DT_S, at_rest, before_door, force, positions, slide};
use hwall_haptics::glam::DVec3;
use hwall_haptics::{
    Board, BoardTarget, MotionConfig, MotionLimits, MovingObject, ObjectCommand, ObjectConfig,
    ObjectPath, ObjectRenderingConfig, RenderInput, RenderedObject, Renderer, RendererConfig,
    Slide,
};
use hwall_kinematics::{JointVelocities, SrsArm};

#[test]
fn a_board_that_is_met_at_speed_brakes_before_it_goes_along_with_the_door() {
    met_on_the_way(None);
}

/// A texture requests a slide from the first moment of the touch.
#[test]
fn a_slide_waits_until_the_board_has_braked() {
    for speed_m_per_s in [0.05, 0.3] {
        met_on_the_way(Some(slide(DVec3::Y * speed_m_per_s)));
    }
}

fn met_on_the_way(slide: Option<Slide>) {
    let q = before_door();
    let arm = SrsArm::iiwa7();
    let mut renderer = Renderer::new(&arm, &Board::default(), RendererConfig::default()).unwrap();
    let first = renderer.arm().forward(&q);
    let door = RenderedObject {
        object: MovingObject::new(ObjectConfig::new(4.0)).unwrap(),
        path: ObjectPath::Sliding {
            direction: -first.rotation().z_axis,
        },
    };
    let config = ObjectRenderingConfig::default();
    renderer
        .set_objects(ObjectCommand::Position, config, vec![door])
        .unwrap();
    let mut state = at_rest(0.0, q);
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default()).unwrap();
    let most = limits.acceleration_rad_per_s2;
    let mut last_qd = [0.0; 7];
    let (mut fastest, mut began_s) = (0.0_f64, None);
    for step in 0..1500 {
        state.t_s = f64::from(step) * DT_S;
        let is_met = step >= 300;
        let push_n = if is_met { -6.0 } else { 0.0 };
        let push = force(renderer.arm().forward(&state.q).rotation().z_axis * push_n);
        state.external_torque = Some(renderer.arm().torques_from_wrench(&state.q, &push));
        let aside = first.position_m() + DVec3::new(-0.25, 0.45, -0.1);
        let target = BoardTarget::new(aside, first.rotation().z_axis, state.t_s);
        let input = RenderInput {
            target: Some(&target),
            object: Some(0),
            slide: slide.as_ref().filter(|_| is_met),
            ..RenderInput::default()
        };
        let answer = renderer.step_with(state.t_s, &state, &input);
        renderer.plan();
        let next = positions(answer.command);
        for joint in 0..7 {
            let qd = (next[joint] - state.q[joint]) / DT_S;
            let acceleration = (qd - last_qd[joint]).abs() / DT_S;
            // The remaining motion at rest, and the object's own motion, are small.
            let small = 0.25 / DT_S;
            assert!(
                step == 0 || acceleration <= (1.01 * most[joint]).max(small),
                "step {step}, joint {}: {acceleration} rad/s2",
                joint + 1
            );
            if !is_met {
                fastest = fastest.max(qd.abs());
            }
            last_qd[joint] = qd;
        }
        state.qd = JointVelocities(last_qd);
        state.q = next;
        if renderer.touched_object().is_some() && began_s.is_none() {
            began_s = Some(state.t_s);
        }
    }
    // The board was fast when it was met; the door moved, but only after the board had braked.
    assert!(fastest > 0.5, "{fastest}");
    let began_s = began_s.expect("a touch");
    assert!((0.32..0.5).contains(&began_s), "{began_s}");
    assert!(renderer.objects()[0].object.position() > 1e-3);
}
