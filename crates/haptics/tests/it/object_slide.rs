//! A board that slides within the face of an object while the object yields.

use crate::support::{DT_S, at_rest, before_door, force, positions, slide};
use hwall_haptics::glam::DVec3;
use hwall_haptics::{
    ArmState, Board, BoardTarget, MovingObject, ObjectCommand, ObjectConfig, ObjectPath,
    ObjectRenderingConfig, RenderInput, RenderStep, RenderedObject, Renderer, RendererConfig,
    Slide,
};
use hwall_kinematics::{Pose, SrsArm};

const PUSH_N: f64 = 5.0;

/// A panel or a door under a push of 5 N, and an arm that executes commands at once.
struct Rig {
    renderer: Renderer,
    state: ArmState,
    first: Pose,
    push_n: f64,
    /// Force of the finger within the face, such as friction, base axes, N.
    drag_n: DVec3,
}

impl Rig {
    fn new(path: impl Fn(&Pose) -> ObjectPath, config: ObjectConfig) -> Self {
        let q = before_door();
        let mut settings = RendererConfig::default();
        settings.force.filter_s = 0.0;
        let mut renderer = Renderer::new(&SrsArm::iiwa7(), &Board::default(), settings).unwrap();
        let first = renderer.arm().forward(&q);
        let object = RenderedObject {
            object: MovingObject::new(config).unwrap(),
            path: path(&first),
        };
        let prompt = ObjectRenderingConfig {
            filter_s: 0.0,
            force_delay_s: Some(0.0),
            motion_delay_s: Some(0.0),
            hand_stiffness_n_per_m: 0.0,
            ..ObjectRenderingConfig::default()
        };
        renderer
            .set_objects(ObjectCommand::Position, prompt, vec![object])
            .unwrap();
        Self {
            renderer,
            state: at_rest(0.0, q),
            first,
            push_n: PUSH_N,
            drag_n: DVec3::ZERO,
        }
    }

    fn face(&self) -> Pose {
        self.renderer.arm().forward(&self.state.q)
    }

    /// How far the face has moved, m.
    fn moved_m(&self) -> DVec3 {
        self.face().position_m() - self.first.position_m()
    }

    /// The position of the object.
    fn opened(&self) -> f64 {
        self.renderer.objects()[0].object.position()
    }

    fn step(&mut self, slide: Option<Slide>) -> RenderStep {
        self.state.t_s += DT_S;
        let push = force(self.face().rotation().z_axis * -self.push_n + self.drag_n);
        let arm = self.renderer.arm();
        self.state.external_torque = Some(arm.torques_from_wrench(&self.state.q, &push));
        let (at_m, normal) = (self.first.position_m(), self.first.rotation().z_axis);
        let target = BoardTarget::new(at_m, normal, self.state.t_s);
        let input = RenderInput {
            target: Some(&target),
            slide: slide.as_ref(),
            object: Some(0),
            ..RenderInput::default()
        };
        let step = self.renderer.step_with(self.state.t_s, &self.state, &input);
        self.renderer.plan();
        self.state.q = positions(step.command);
        step
    }
}

fn inward(face: &Pose) -> ObjectPath {
    ObjectPath::sliding(-face.rotation().z_axis).unwrap()
}

fn spring() -> ObjectConfig {
    ObjectConfig {
        stiffness: 200.0,
        damping: 30.0,
        ..ObjectConfig::new(4.0)
    }
}

#[test]
fn a_textured_panel_yields_as_its_closed_form_and_scans_with_the_speed_of_its_texture() {
    for (speed, turn) in [(0.05_f64, 0.0), (-0.08, 0.0), (0.03, 0.2)] {
        let mut rig = Rig::new(inward, spring());
        let [x, z] = [rig.first.rotation().x_axis, rig.first.rotation().z_axis];
        // The component along the normal is not part of the slide.
        let slide = Slide {
            velocity_m_per_s: x * speed + z * 0.5,
            turn_rad_per_s: turn,
        };
        let mut ideal = MovingObject::new(spring()).unwrap();
        let mut before: Option<f64> = None;
        for k in 0..600 {
            let step = rig.step(Some(slide));
            assert!(step.sliding && step.unreachable.is_none(), "{k}: {step:?}");
            ideal.step(PUSH_N, DT_S).unwrap();
            let by_m = rig.moved_m();
            // The face catches up with motion beyond its limits.
            let along_m = -by_m.dot(z);
            let off_m = (along_m - ideal.position()).abs();
            assert!(off_m < 2e-4, "{k}: {along_m} for {}", ideal.position());
            let across_m = by_m.dot(x);
            if let (Some(last), true) = (before, k > 100) {
                let scans = (across_m - last) / DT_S;
                assert!((scans / speed - 1.0).abs() < 0.05, "{k}: {scans} m/s");
            }
            before = Some(across_m);
            assert!(by_m.dot(z.cross(x)).abs() < 1e-4);
        }
        assert!((ideal.position() - PUSH_N / 200.0).abs() < 5e-3);
        // Without a request it comes to rest within the face, and the panel stays.
        for _ in 0..200 {
            rig.step(None);
        }
        let at_m = rig.face().position_m();
        assert!(!rig.step(None).sliding);
        let moved_m = (rig.face().position_m() - at_m).reject_from_normalized(z);
        assert!(moved_m.length() < 1e-7, "{moved_m}");
        let ledger = rig.renderer.objects()[0].object.energy_j();
        assert!(ledger > 0.05, "{ledger}");
    }
}

#[test]
fn on_a_door_the_slide_turns_with_it() {
    let hinged = |face: &Pose| {
        let [x, y, z] = [
            face.rotation().x_axis,
            face.rotation().y_axis,
            face.rotation().z_axis,
        ];
        // About the board's own y axis, 0.5 m beside it; a push opens it.
        ObjectPath::turning(face.position_m() - 0.5 * x, y * z.cross(x).dot(y)).unwrap()
    };
    let config = ObjectConfig {
        damping: 4.0,
        ..ObjectConfig::new(2.0)
    };
    let mut rig = Rig::new(hinged, config);
    for k in 0..400 {
        // As a texture does: along the current surface.
        let y = rig.face().rotation().y_axis;
        let before = rig.face();
        let step = rig.step(Some(slide(y * 0.05)));
        assert!(step.sliding, "{k}: {step:?}");
        let scans = (rig.face().position_m() - before.position_m()).dot(y) / DT_S;
        if k > 100 {
            assert!((scans / 0.05 - 1.0).abs() < 0.05, "{k}: {scans} m/s");
        }
    }
    assert!(rig.opened().abs() > 0.05);
}

#[test]
fn a_drawer_does_not_slide_along_its_own_path_and_bad_slides_are_none() {
    let mut rig = panel(spring());
    let x = rig.first.rotation().x_axis;
    for velocity_m_per_s in [x * 0.1, DVec3::NAN] {
        for _ in 0..100 {
            let step = rig.step(Some(slide(velocity_m_per_s)));
            assert_eq!(step.sliding, velocity_m_per_s.is_finite());
        }
        let by_m = rig.moved_m();
        assert!(by_m.length() < 1e-5, "{by_m}");
    }
}

/// A sliding panel: its path lies in its face.
fn panel(config: ObjectConfig) -> Rig {
    let along = |face: &Pose| ObjectPath::sliding(face.rotation().x_axis).unwrap();
    Rig::new(along, config)
}

#[test]
fn a_panel_that_is_dragged_along_its_face_scans_across_its_path() {
    let config = ObjectConfig {
        damping: 10.0,
        ..ObjectConfig::new(5.0)
    };
    let mut rig = panel(config.clone());
    let [x, y] = [rig.first.rotation().x_axis, rig.first.rotation().y_axis];
    rig.drag_n = x * 1.5;
    let slide = slide(x * 0.03 + y * 0.05);
    let mut ideal = MovingObject::new(config).unwrap();
    let (mut before_m, mut off_m, mut off) = (0.0, 0.0_f64, 0.0_f64);
    for k in 0..700 {
        let step = rig.step(Some(slide));
        assert!(step.sliding && step.unreachable.is_none(), "{k}: {step:?}");
        ideal.step(1.5, DT_S).unwrap();
        let by_m = rig.moved_m();
        off_m = off_m.max((by_m.dot(x) - ideal.position()).abs());
        if k > 100 {
            off = off.max(((by_m.dot(y) - before_m) / DT_S / 0.05 - 1.0).abs());
        }
        before_m = by_m.dot(y);
    }
    println!("along {off_m} m off the closed form, across {off} of the speed off");
    assert!(ideal.position() > 0.04, "{}", ideal.position());
    assert!(off_m < 2e-4, "{off_m} m");
    assert!(off < 0.02, "{off}");
}

#[test]
fn a_panel_that_is_held_scans_along_its_path_until_it_gives_way() {
    let stopped = ObjectConfig {
        damping: 10.0,
        range: [0.0, 0.5],
        ..ObjectConfig::new(5.0)
    };
    let stuck = ObjectConfig {
        friction: 8.0,
        range: [-0.5, 0.5],
        ..stopped.clone()
    };
    // The push that holds it, and the one that moves it.
    for (name, config, holds_n, moves_n) in [
        ("at its stop", stopped, -3.0, 4.0),
        ("by friction", stuck, 3.0, 14.0),
    ] {
        let mut rig = panel(config.clone());
        let x = rig.first.rotation().x_axis;
        // Against the finger that drags it, and for any duration of touch.
        let speed = 0.04 * -f64::signum(holds_n);
        let slide = Some(slide(x * speed));
        rig.drag_n = x * holds_n;
        let (mut before_m, mut off) = (0.0, 0.0_f64);
        for k in 0..1500 {
            rig.step(slide);
            let along_m = rig.moved_m().dot(x);
            if k > 200 {
                off = off.max(((along_m - before_m) / DT_S / speed - 1.0).abs());
            }
            before_m = along_m;
            assert_eq!(rig.opened(), 0.0, "{name}");
        }
        assert!(off < 0.02, "{name}: {off}");
        // The panel moves: the board moves with it, and stops sliding.
        rig.drag_n = x * moves_n;
        let mut ideal = MovingObject::new(config).unwrap();
        let (mut position_off_m, mut board_off_m) = (0.0_f64, 0.0_f64);
        let mut rests_m = None;
        for k in 0..300 {
            rig.step(slide);
            ideal.step(moves_n, DT_S).unwrap();
            let at_m = rig.opened();
            position_off_m = position_off_m.max((at_m - ideal.position()).abs());
            let along_m = rig.moved_m().dot(x) - at_m;
            // The remaining slide needs its braking time.
            if k == 100 {
                rests_m = Some(along_m);
            }
            if let Some(rests_m) = rests_m {
                board_off_m = board_off_m.max((along_m - rests_m).abs());
            }
        }
        assert!(ideal.position() > 0.02, "{name}: {}", ideal.position());
        assert!(position_off_m < 2e-4, "{name}: {position_off_m} m");
        assert!(board_off_m < 2e-4, "{name}: {board_off_m} m");
    }
}

#[test]
fn a_door_that_is_let_go_is_left_without_a_leap() {
    let mut rig = Rig::new(inward, spring());
    rig.push_n = 20.0;
    for _ in 0..600 {
        rig.step(None);
    }
    assert!(rig.opened() > 0.08, "{}", rig.opened());
    // The finger disappears within one cycle; the board would be at its goal where the door was.
    rig.push_n = 0.0;
    let most = rig.renderer.follower().limits().velocity_rad_per_s;
    for k in 0..1500 {
        let before = rig.state.q;
        rig.step(None);
        let leap_rad = rig.state.q.max_abs_difference(&before);
        let most_rad = most.iter().fold(0.0_f64, |a, b| a.max(*b)) * DT_S;
        assert!(leap_rad <= most_rad, "{k}: {leap_rad} rad");
    }
    assert!(rig.renderer.touched_object().is_none());
}

#[test]
fn a_slide_on_an_object_brakes_before_a_joint_meets_its_limit() {
    // Joint 7 begins at 90 of 175 degrees.
    for turn in [0.5, 0.3] {
        let mut rig = Rig::new(inward, spring());
        let most = ObjectRenderingConfig::default().max_acceleration_rad_per_s2;
        let (mut qd, mut stopped, mut worst) = ([0.0; 7], 0, 0.0_f64);
        let mut ideal = MovingObject::new(spring()).unwrap();
        for k in 0..9000 {
            let before = rig.state.q;
            let slide = Slide {
                turn_rad_per_s: turn,
                ..Slide::default()
            };
            let step = rig.step(Some(slide));
            ideal.step(PUSH_N, DT_S).unwrap();
            stopped += usize::from(!step.sliding);
            for j in 0..7 {
                let now = (rig.state.q[j] - before[j]) / DT_S;
                if k > 20 {
                    worst = worst.max((now - qd[j]).abs() / (most[j] * DT_S));
                }
                qd[j] = now;
            }
            // Whatever happens to the slide, the panel yields.
            let at = rig.opened();
            assert!((at - ideal.position()).abs() < 2e-4, "{k}: {at}");
        }
        println!("turn {turn}: {worst} of the accelerations, stopped for {stopped} steps");
        assert!(stopped > 100, "{stopped}");
        assert!(worst < 1.5, "{worst}");
    }
}
