//! The renderer against a perfect arm: following, touching, every watchdog, every recovery.

use crate::support::{DT_S, at_rest, home, positions, pressed, rates};
use glam::DVec3;
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, HoldReason, Phase, RenderStep, Renderer,
    RendererConfig,
};
use hwall_kinematics::{JointTorques, JointVelocities, SrsArm, Unreachable, Wrench};
use hwall_testkit::{ErrorStats, Sampler, refused};

/// An arm that executes commands at once, and a renderer.
struct Rig {
    renderer: Renderer,
    now_s: f64,
    state: ArmState,
    target: Option<BoardTarget>,
    press_n: f64,
}

/// Thresholds are tested to the sample here; force.rs tests the filter.
fn unfiltered() -> RendererConfig {
    let mut config = RendererConfig::default();
    config.force.filter_s = 0.0;
    config
}

impl Rig {
    fn new() -> Self {
        Self {
            renderer: Renderer::new(&SrsArm::iiwa7(), &Board::default(), unfiltered()).unwrap(),
            now_s: 0.0,
            state: at_rest(0.0, home()),
            target: Some(BoardTarget {
                roll_rad: None,
                ..BoardTarget::new(DVec3::new(0.55, 0.1, 0.6), DVec3::X, 0.0)
            }),
            press_n: 0.0,
        }
    }

    /// A step with good inputs.
    fn step(&mut self) -> RenderStep {
        self.step_with(|_, _, _| {})
    }

    /// A step whose inputs (time, state, target) are corrupted before they reach the renderer.
    fn step_with(
        &mut self,
        spoil: impl Fn(&mut f64, &mut ArmState, &mut Option<BoardTarget>),
    ) -> RenderStep {
        self.now_s += DT_S;
        self.state.t_s = self.now_s;
        let torque = pressed(&**self.renderer.arm(), &self.state.q, self.press_n);
        self.state.external_torque = Some(torque);
        if let Some(target) = &mut self.target {
            target.stamp_s = self.now_s;
        }
        let (mut now_s, mut state, mut target) = (self.now_s, self.state, self.target);
        spoil(&mut now_s, &mut state, &mut target);
        let step = self.renderer.step(now_s, &state, target.as_ref());
        self.renderer.plan();
        if let ArmCommand::Position(q) = step.command {
            self.state.qd = rates(&self.state.q, &q);
            self.state.q = q;
        } else {
            self.state.qd = JointVelocities::default();
        }
        step
    }

    fn run(&mut self, steps: usize) -> RenderStep {
        (0..steps).map(|_| self.step()).last().unwrap()
    }

    /// It goes on to the target as if nothing had happened.
    fn recovers(&mut self) {
        assert_eq!(self.run(3000).phase, Phase::NonContact);
        assert!(self.arrived());
    }

    fn arrived(&self) -> bool {
        let pose = self.renderer.arm().forward(&self.state.q);
        let target = self.target.unwrap();
        pose.position_m().distance(target.point_m) < 1e-11
            && pose.rotation().z_axis.distance(target.normal) < 1e-11
    }
}

#[test]
fn a_touch_freezes_the_board_and_its_end_frees_it() {
    let mut rig = Rig::new();
    rig.run(3000);
    let at = rig.state.q;
    rig.press_n = 10.0;
    let step = rig.step();
    let since_s = rig.now_s;
    assert_eq!(step.phase, Phase::Contact { since_s });
    let force_n = step.normal_force_n.unwrap();
    assert!((force_n - 10.0).abs() < 0.3, "{step:?}");
    // The target drifts away, or is lost: a wall stays.
    rig.target.as_mut().unwrap().point_m.y += 0.1;
    assert_eq!(rig.run(500).phase, Phase::Contact { since_s });
    let lost = rig.step_with(|_, _, target| *target = None);
    assert_eq!(lost.phase, Phase::Contact { since_s });
    assert_eq!(rig.state.q, at);
    rig.press_n = 0.0;
    assert_eq!(rig.run(49).phase, Phase::Contact { since_s });
    rig.recovers();
}

#[test]
fn a_touch_on_the_way_brakes_within_the_limits() {
    let mut rig = Rig::new();
    rig.run(150);
    rig.press_n = 20.0;
    let mut speed_before = rig.state.qd;
    for _ in 0..400 {
        assert!(matches!(rig.step().phase, Phase::Contact { .. }));
        let speed = rig.state.qd;
        for j in 0..7 {
            let most = rig.renderer.follower().limits().acceleration_rad_per_s2[j];
            assert!((speed[j] - speed_before[j]).abs() <= most * DT_S + 1e-9);
        }
        speed_before = speed;
    }
    assert!(speed_before.0.iter().all(|v| *v == 0.0));
    assert!(!rig.arrived());
}

#[test]
fn pulling_is_no_touch() {
    let mut rig = Rig::new();
    rig.press_n = -30.0;
    let step = rig.run(100);
    assert_eq!(step.phase, Phase::NonContact);
    assert!(step.normal_force_n.unwrap() < -28.0);
}

#[test]
fn an_arm_without_torque_sensors_follows_and_never_reports_a_touch() {
    let mut rig = Rig::new();
    rig.press_n = 50.0;
    for _ in 0..3000 {
        let step = rig.step_with(|_, state, _| state.external_torque = None);
        assert_eq!((step.phase, step.normal_force_n), (Phase::NonContact, None));
    }
    assert!(rig.arrived());
}

#[test]
fn a_stale_target_holds_with_its_age_and_recovers() {
    let mut rig = Rig::new();
    rig.run(100);
    for age_s in [0.26, 5.0, -0.3] {
        let step =
            rig.step_with(|now_s, _, target| target.as_mut().unwrap().stamp_s = *now_s - age_s);
        let Phase::Hold(HoldReason::StaleTarget { age_s: told }) = step.phase else {
            panic!("{step:?}")
        };
        assert!((told - age_s).abs() < 1e-12);
    }
    let young = rig.step_with(|now_s, _, target| target.as_mut().unwrap().stamp_s = *now_s - 0.24);
    assert_eq!(young.phase, Phase::NonContact);
    for _ in 0..300 {
        rig.step_with(|_, _, target| *target = None);
    }
    let at = rig.state.q;
    let step = rig.step_with(|_, _, target| *target = None);
    assert_eq!(step.phase, Phase::Hold(HoldReason::NoTarget));
    assert_eq!(step.command, ArmCommand::Position(at));
    rig.recovers();
}

#[test]
fn a_nan_target_holds_and_recovers() {
    let mut rig = Rig::new();
    rig.run(100);
    let spoils: [fn(&mut BoardTarget); 4] = [
        |target| target.point_m.z = f64::NAN,
        |target| target.normal.x = f64::INFINITY,
        |target| target.normal = DVec3::ZERO,
        |target| target.stamp_s = f64::NAN,
    ];
    for spoil in spoils {
        let step = rig.step_with(|_, _, target| spoil(target.as_mut().unwrap()));
        assert_eq!(step.phase, Phase::Hold(HoldReason::InvalidTarget));
    }
    rig.recovers();
}

#[test]
fn a_stale_state_holds_with_its_age_and_recovers() {
    let mut rig = Rig::new();
    rig.run(100);
    for age_s in [0.11, -0.2] {
        let step = rig.step_with(|now_s, state, _| state.t_s = *now_s - age_s);
        assert_eq!(step.command, ArmCommand::Hold);
        let Phase::Hold(HoldReason::StaleState { age_s: told }) = step.phase else {
            panic!("{step:?}")
        };
        assert!((told - age_s).abs() < 1e-12);
    }
    rig.recovers();
}

#[test]
fn a_nan_in_the_state_holds_and_names_it() {
    let mut rig = Rig::new();
    rig.run(100);
    type Spoil = fn(&mut ArmState);
    let spoils: [(&str, usize, Spoil); 4] = [
        ("t_s", 0, |state| state.t_s = f64::NAN),
        ("q", 3, |state| state.q[3] = f64::NAN),
        ("qd", 6, |state| state.qd[6] = f64::INFINITY),
        ("external_torque", 1, |state| {
            state.external_torque.as_mut().unwrap()[1] = f64::NAN
        }),
    ];
    for (what, joint, spoil) in spoils {
        let step = rig.step_with(|_, state, _| spoil(state));
        assert_eq!(step.command, ArmCommand::Hold);
        let reason = HoldReason::NonFiniteState { what, joint };
        assert_eq!(step.phase, Phase::Hold(reason));
    }
    for torque_n_m in [1e6, 1e300, f64::MAX] {
        let huge = Some(JointTorques([torque_n_m; 7]));
        let step = rig.step_with(|_, state, _| state.external_torque = huge);
        let Phase::Hold(HoldReason::ImplausibleForce { .. }) = step.phase else {
            panic!("{step:?}")
        };
    }
    rig.recovers();
}

#[test]
fn a_bad_clock_holds_and_recovers() {
    let mut rig = Rig::new();
    rig.run(100);
    for bad in [f64::NAN, f64::INFINITY] {
        let step = rig.step_with(|now_s, _, _| *now_s = bad);
        assert_eq!(step.command, ArmCommand::Hold);
        assert_eq!(step.phase, Phase::Hold(HoldReason::NonFiniteTime));
    }
    rig.now_s -= 50.0;
    let step = rig.step();
    assert!(matches!(step.phase, Phase::Hold(HoldReason::TimeReversed { by_s }) if by_s > 49.0));
    rig.recovers();
}

#[test]
fn no_command_before_the_first_good_state_and_none_far_from_the_arm() {
    let mut rig = Rig::new();
    let first = rig.step_with(|_, state, _| state.q[0] = f64::NAN);
    assert_eq!(first.command, ArmCommand::Hold);
    // It starts at the measured configuration.
    let q = positions(rig.step().command);
    assert!(q.max_abs_difference(&rig.state.q) < 1e-2);
    // The arm was moved by hand while there was no state.
    rig.run(200);
    rig.step_with(|_, state, _| state.t_s -= 1.0);
    rig.state.q[0] += 0.5;
    let moved = rig.state.q;
    // Until the arm has had time to stop.
    let mut commands = (0..500).map(|_| rig.step().command);
    let first = commands.find(|command| *command != ArmCommand::Hold);
    let q = positions(first.expect("a command"));
    assert!(q.max_abs_difference(&moved) < 1e-2);
}

#[test]
fn an_unreachable_target_holds_the_last_goal_with_its_reason_and_recovers() {
    let mut rig = Rig::new();
    let far = |_: &mut f64, _: &mut ArmState, target: &mut Option<BoardTarget>| {
        target.as_mut().unwrap().point_m.x = 3.0;
    };
    let at = rig.state.q;
    // Requested in a step, reported in the next.
    rig.step_with(far);
    let step = rig.step_with(far);
    assert_eq!((step.command, step.goal), (ArmCommand::Position(at), None));
    assert!(matches!(step.unreachable, Some(Unreachable::TooFar { .. })));
    let goal = rig.run(200).goal;
    rig.step_with(far);
    for _ in 0..3000 {
        let step = rig.step_with(far);
        assert!(
            matches!(step.unreachable, Some(Unreachable::TooFar { gap_m }) if gap_m > 0.5),
            "{step:?}"
        );
        assert_eq!((step.phase, step.goal), (Phase::NonContact, goal));
    }
    // A place inside the base keeps the goal, too.
    let inside = |_: &mut f64, _: &mut ArmState, target: &mut Option<BoardTarget>| {
        target.as_mut().unwrap().point_m = DVec3::new(0.0, 0.0, 0.34);
    };
    rig.step_with(inside);
    let step = rig.step_with(inside);
    assert!(step.unreachable.is_some() && step.goal == goal, "{step:?}");
    assert_eq!(Some(rig.state.q), goal);
    rig.target.as_mut().unwrap().point_m.y -= 0.2;
    assert_eq!(rig.run(3000).unreachable, None);
    assert!(rig.arrived());
}

/// Presses anywhere on the board, with friction along it: only the normal component counts.
#[test]
fn a_press_of_known_force_is_estimated() {
    let mut s = Sampler::new(31);
    let rig = Rig::new();
    let arm = rig.renderer.arm().clone();
    let mut errors = Vec::new();
    for _ in 0..500 {
        let point_m = s.point_in_box(DVec3::new(0.45, -0.3, 0.3), DVec3::new(0.65, 0.3, 0.8));
        let normal = (DVec3::X + 0.3 * s.unit_vector()).normalize();
        let pose = hwall_haptics::board_pose(point_m, normal, 0.0).unwrap();
        let Ok(found) = arm.nearest(&pose, &rig.state.q, &Default::default(), &mut arm.scratch())
        else {
            continue;
        };
        let press_n = s.uniform(1.0, 50.0);
        let (x, y) = (pose.rotation().x_axis, pose.rotation().y_axis);
        let place = x * s.uniform(-0.1, 0.1) + y * s.uniform(-0.1, 0.1);
        let force_n =
            -normal * press_n + (x * s.uniform(-0.3, 0.3) + y * s.uniform(-0.3, 0.3)) * press_n;
        let wrench = Wrench {
            force_n,
            moment_n_m: place.cross(force_n),
        };
        let torque = arm.torques_from_wrench(&found.q, &wrench);
        let state = ArmState {
            external_torque: Some(torque),
            ..at_rest(0.0, found.q)
        };
        let step = Rig::new().renderer.step(0.0, &state, None);
        let estimate = step.normal_force_n.unwrap();
        errors.push((estimate - press_n).abs() / press_n);
    }
    assert!(errors.len() > 400);
    let stats = ErrorStats::from_errors(errors);
    let bounded = stats.median < 2e-3 && stats.q99 < 0.02 && stats.max < 0.05;
    assert!(bounded, "{stats:?}");
}

#[test]
fn settings_out_of_range_are_named() {
    let make = |config| Renderer::new(&SrsArm::iiwa7(), &Board::default(), config);
    refused!(RendererConfig::default(), make, {
        force.damping_m = f64::NAN;
        force.moment_length_m = 0.0;
        force.filter_s = f64::INFINITY, -1e-9;
        follower.approach.allowed_m = f64::INFINITY, -1e-9;
        proximity.clearance_m = f64::INFINITY, -1e-9;
        proximity.braking_m_per_s2 = 0.0;
        watchdog.max_target_age_s = -1.0;
        watchdog.max_state_age_s = 0.0;
        watchdog.max_step_s = f64::NAN;
        contact.on_n = f64::NAN;
    });
}
