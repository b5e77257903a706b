//! Every watchdog and every limit of the supervisor, one by one.

use glam::DVec3;
use hwall_haptics::safety::{
    Channel, GuardLimits, PersonPart, PersonPoint, SafeReason, SafeRequest, SafeState, Supervisor,
    SupervisorConfig, SupervisorInput, SupervisorStep, WorkspaceBox,
};
use hwall_haptics::{ArmCommand, ArmState, Board};
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, JointVelocities, SrsArm, Wrench,
};

const DT_S: f64 = 1e-3;

/// A loop with an arm that does at once what it is told.
struct Bench {
    supervisor: Supervisor,
    now_s: f64,
    state: ArmState,
    person: Vec<PersonPoint>,
    target: Option<DVec3>,
    force: Option<Wrench>,
    command: ArmCommand,
    ticks: u32,
    /// Things that tremble, as measured ones do.
    trembles: bool,
}

fn home() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

impl Bench {
    fn new() -> Self {
        Self::with(SupervisorConfig::default())
    }

    fn with(config: SupervisorConfig) -> Self {
        let far = |part, y: f64| PersonPoint {
            part,
            position_m: DVec3::new(2.0, y, 1.0),
            stamp_s: 0.0,
        };
        let person = vec![
            far(PersonPart::Fingertip, 0.0),
            far(PersonPart::Palm, 0.1),
            far(PersonPart::Head, 0.3),
        ];
        Self {
            supervisor: Supervisor::new(&SrsArm::iiwa7(), &Board::default(), config).unwrap(),
            now_s: 10.0,
            state: ArmState {
                t_s: 10.0,
                q: home(),
                qd: JointVelocities::default(),
                external_torque: Some(JointTorques::default()),
            },
            person,
            target: Some(DVec3::new(0.6, 0.0, 0.6)),
            force: Some(Wrench::default()),
            command: ArmCommand::Position(home()),
            ticks: 0,
            trembles: true,
        }
    }

    /// One cycle; `spoil` changes what the supervisor is handed.
    fn step_with(&mut self, spoil: impl Fn(&mut Self, &mut f64)) -> SupervisorStep {
        self.now_s += DT_S;
        self.ticks += 1;
        self.state.t_s = self.now_s;
        for point in &mut self.person {
            point.stamp_s = self.now_s;
            if self.trembles {
                point.position_m.z += if self.ticks.is_multiple_of(2) {
                    1e-5
                } else {
                    -1e-5
                };
            }
        }
        let mut now_s = self.now_s;
        let sound = (
            self.state,
            self.person.clone(),
            self.target,
            self.force,
            self.command,
        );
        spoil(self, &mut now_s);
        let input = SupervisorInput {
            now_s,
            state: &self.state,
            person: &self.person,
            target: self.target.map(|target| (target, self.now_s)),
            force: self.force,
            command: self.command,
        };
        let step = self.supervisor.step(&input);
        (
            self.state,
            self.person,
            self.target,
            self.force,
            self.command,
        ) = sound;
        step
    }

    fn step(&mut self) -> SupervisorStep {
        self.step_with(|_, _| {})
    }

    fn run(&mut self, steps: usize) -> SupervisorStep {
        let mut last = self.step();
        for _ in 1..steps {
            last = self.step();
        }
        last
    }

    fn run_with(&mut self, steps: usize, spoil: impl Fn(&mut Self, &mut f64)) -> SupervisorStep {
        let mut last = self.step_with(&spoil);
        for _ in 1..steps {
            last = self.step_with(&spoil);
        }
        last
    }
}

/// A fault stands at once, ends in its last state in the time that is stated, and is forgotten after the recovery time.
fn faulty(channel: Channel, kind: &str, retreats: bool, spoil: impl Fn(&mut Bench, &mut f64)) {
    let mut bench = Bench::new();
    assert_eq!(bench.run(50).state, SafeState::Normal, "{channel:?} {kind}");
    let first = bench.step_with(&spoil);
    let SafeState::Holding { reason } = first.state else {
        panic!("{channel:?} {kind}: {first:?}");
    };
    assert_eq!(
        (reason.channel(), reason.name()),
        (Some(channel), kind),
        "{reason:?}"
    );
    assert_eq!(first.command, ArmCommand::Hold);
    assert_eq!(first.request, SafeRequest::Hold);
    // One bad sample: back after the recovery time.
    let mut once = Bench::new();
    once.run(50);
    once.step_with(&spoil);
    assert_eq!(once.step().state.name(), "holding");
    assert_eq!(once.run(270).state, SafeState::Normal, "{channel:?} {kind}");
    // Bad for ever.
    let longest_s = bench.supervisor.config().longest_to_last_state_s();
    let after_hold = bench.run_with(310, &spoil);
    let wanted = if retreats { "retreating" } else { "stopped" };
    assert_eq!(
        after_hold.state.name(),
        wanted,
        "{channel:?} {kind}: {after_hold:?}"
    );
    let last = bench.run_with((longest_s / DT_S) as usize, &spoil);
    assert_eq!(last.state.name(), "stopped", "{channel:?} {kind}");
    assert_eq!(last.command, ArmCommand::Hold);
    assert!(!last.latched);
    let back = bench.run(600);
    assert_eq!(back.state, SafeState::Normal, "{channel:?} {kind}");
}

#[test]
fn nan_on_every_channel() {
    faulty(Channel::Time, "non_finite", false, |_, now| *now = f64::NAN);
    faulty(Channel::Position, "non_finite", false, |b, _| {
        b.state.t_s = f64::INFINITY
    });
    faulty(Channel::Position, "non_finite", false, |b, _| {
        b.state.q[3] = f64::NAN
    });
    faulty(Channel::Velocity, "non_finite", false, |b, _| {
        b.state.qd[0] = f64::INFINITY
    });
    faulty(Channel::Torque, "non_finite", true, |b, _| {
        b.state.external_torque = Some(JointTorques([f64::NAN; 7]));
    });
    faulty(Channel::Fingertip, "non_finite", true, |b, _| {
        b.person[0].position_m.x = f64::NAN
    });
    faulty(Channel::Palm, "non_finite", true, |b, _| {
        b.person[1].position_m.y = f64::INFINITY
    });
    faulty(Channel::Head, "non_finite", true, |b, _| {
        b.person[2].stamp_s = f64::NAN
    });
    faulty(Channel::Target, "non_finite", true, |b, _| {
        b.target = Some(DVec3::NAN)
    });
    faulty(Channel::Force, "non_finite", true, |b, _| {
        b.force = Some(Wrench {
            force_n: DVec3::NAN,
            ..Wrench::default()
        });
    });
    faulty(Channel::Command, "non_finite", false, |b, _| {
        b.command = ArmCommand::Position(JointPositions([f64::NAN; 7]));
    });
    faulty(Channel::Command, "non_finite", false, |b, _| {
        b.command = ArmCommand::Torque(JointTorques([f64::INFINITY; 7]));
    });
}

#[test]
fn stale_inputs() {
    faulty(Channel::Position, "stale", false, |b, _| b.state.t_s -= 0.2);
    faulty(Channel::Position, "stale", false, |b, _| b.state.t_s += 0.2);
    faulty(Channel::Fingertip, "stale", true, |b, _| {
        b.person[0].stamp_s -= 0.3
    });
    faulty(Channel::Palm, "stale", true, |b, _| {
        b.person[1].stamp_s -= 0.3
    });
    faulty(Channel::Head, "stale", true, |b, _| {
        b.person[2].stamp_s -= 0.3
    });
}

/// What was there once and does not come any more ages.
#[test]
fn missing_inputs() {
    let missing = |channel: Channel, steps: usize, spoil: fn(&mut Bench)| {
        let mut bench = Bench::new();
        bench.run(10);
        let before = bench.run_with(steps - 20, |b, _| spoil(b));
        assert_eq!(before.state, SafeState::Normal);
        let after = bench.run_with(40, |b, _| spoil(b));
        let reason = after.state.reason().unwrap();
        assert_eq!((reason.channel(), reason.name()), (Some(channel), "stale"));
        assert_eq!(after.state.name(), "holding");
    };
    missing(Channel::Fingertip, 250, |b| {
        b.person.remove(0);
    });
    missing(Channel::Palm, 250, |b| {
        b.person.remove(1);
    });
    missing(Channel::Head, 250, |b| {
        b.person.remove(2);
    });
    missing(Channel::Torque, 100, |b| b.state.external_torque = None);
    missing(Channel::Force, 100, |b| b.force = None);
    // Not when it was said before.
    let mut bench = Bench::new();
    bench.run(10);
    for part in PersonPart::ALL {
        bench.supervisor.forget(part);
    }
    assert_eq!(
        bench.run_with(2000, |b, _| b.person.clear()).state,
        SafeState::Normal
    );
}

/// Leaps alternate, so that they last.
#[test]
fn jumping_inputs() {
    let odd = |b: &Bench| b.ticks % 2 == 1;
    let by = move |b: &Bench, size: f64| if odd(b) { size } else { 0.0 };
    faulty(Channel::Time, "jump", false, move |b, now| {
        *now += if odd(b) { 5.0 } else { -5.0 }
    });
    faulty(Channel::Position, "jump", false, move |b, _| {
        b.state.q[1] += by(b, 0.1)
    });
    faulty(Channel::Velocity, "jump", false, move |b, _| {
        b.state.qd[6] += by(b, 1.6)
    });
    faulty(Channel::Fingertip, "jump", true, move |b, _| {
        b.person[0].position_m.x += by(b, 0.5)
    });
    faulty(Channel::Palm, "jump", true, move |b, _| {
        b.person[1].position_m.z += by(b, 0.5)
    });
    faulty(Channel::Head, "jump", true, move |b, _| {
        b.person[2].position_m.y += by(b, 0.5)
    });
    faulty(Channel::Command, "jump", false, |b, _| {
        let mut far = home();
        far[0] += 0.8;
        b.command = ArmCommand::Position(far);
    });
}

#[test]
fn a_clock_that_stands_or_runs_backwards() {
    let mut bench = Bench::new();
    bench.run(10);
    let stands = bench.run_with(30, |_, now| *now = 10.02);
    assert_eq!(stands.state.name(), "holding");
    assert_eq!(
        stands.state.reason().unwrap().channel(),
        Some(Channel::Time)
    );
    let last = bench.run_with(2500, |_, now| *now = 10.02);
    assert_eq!(last.state.name(), "stopped");
    let mut bench = Bench::new();
    bench.run(10);
    let back = bench.step_with(|_, now| *now -= 0.1);
    assert_eq!(back.state.reason().unwrap().name(), "jump");
}

#[test]
fn frozen_inputs() {
    let frozen = |channel: Channel, within: usize, spoil: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::new();
        bench.run(20);
        let mut seen = None;
        for i in 0..within {
            // The command moves slowly, and the arm with it.
            let mut q = home();
            q[0] += 2e-4 * i as f64;
            bench.command = ArmCommand::Position(q);
            bench.state.q = q;
            bench.state.qd[0] = 0.2;
            bench.state.external_torque = Some(JointTorques([0.1 + 1e-6 * i as f64; 7]));
            let step = bench.step_with(|b, _| spoil(b));
            if let SafeState::Holding { reason } = step.state {
                seen = Some((reason, i));
                break;
            }
            assert_eq!(step.state, SafeState::Normal, "{channel:?} {i}");
        }
        let (reason, _) = seen.unwrap_or_else(|| panic!("{channel:?}: not seen"));
        assert_eq!((reason.channel(), reason.name()), (Some(channel), "frozen"));
    };
    frozen(Channel::Position, 120, &|b| b.state.q = home());
    frozen(Channel::Velocity, 230, &|b| {
        b.state.qd = JointVelocities([0.02; 7])
    });
    frozen(Channel::Torque, 230, &|b| {
        b.state.external_torque = Some(JointTorques([0.3; 7]))
    });
    frozen(Channel::Fingertip, 1050, &|b| {
        b.person[0].position_m = DVec3::new(2.0, 0.0, 1.0)
    });
    frozen(Channel::Palm, 1050, &|b| {
        b.person[1].position_m = DVec3::new(2.0, 0.1, 1.0)
    });
    frozen(Channel::Head, 1050, &|b| {
        b.person[2].position_m = DVec3::new(2.0, 0.3, 1.0)
    });
    // An arm that stands is not frozen, and neither is a noiseless sensor that feels nothing.
    let mut bench = Bench::new();
    assert_eq!(bench.run(3000).state, SafeState::Normal);
}

#[test]
fn too_much_force_withdraws_at_once_and_is_latched() {
    let push = |force_n: f64| Wrench {
        force_n: DVec3::new(-force_n, 0.0, 0.0),
        ..Wrench::default()
    };
    let mut bench = Bench::new();
    bench.run(10);
    // An impact within the limit is allowed for half a second.
    let normal = bench.run_with(450, |b, _| b.force = Some(push(200.0)));
    assert_eq!(normal.state, SafeState::Normal);
    let lasting = bench.run_with(60, |b, _| b.force = Some(push(200.0)));
    assert_eq!(lasting.state.name(), "retreating");
    assert!(lasting.latched && matches!(lasting.request, SafeRequest::Retreat { .. }));
    let SafeReason::Force { limit_n, .. } = lasting.state.reason().unwrap() else {
        panic!("{lasting:?}");
    };
    assert_eq!(limit_n, 140.0);
    // Gone, but latched: it ends in stopped, until it is reset.
    let last = bench.run(3000);
    assert_eq!((last.state.name(), last.latched), ("stopped", true));
    bench.supervisor.reset();
    assert_eq!(bench.run(300).state, SafeState::Normal);

    let mut bench = Bench::new();
    bench.run(10);
    let hit = bench.step_with(|b, _| b.force = Some(push(300.0)));
    assert_eq!(hit.state.name(), "retreating");
    let mut bench = Bench::new();
    bench.run(10);
    let broken = bench.step_with(|b, _| b.force = Some(push(5000.0)));
    assert_eq!((broken.state.name(), broken.latched), ("holding", true));
    assert_eq!(broken.state.reason().unwrap().name(), "implausible_force");
    assert_eq!(bench.run(400).state.name(), "holding");
    assert_eq!(
        bench
            .run_with(400, |b, _| b.force = Some(push(5000.0)))
            .state
            .name(),
        "stopped"
    );
}

/// A torque-controlled arm gives way instead, as fast as torques may change.
#[test]
fn too_much_force_on_a_torque_arm_makes_it_float() {
    let mut bench = Bench::new();
    bench.command = ArmCommand::Torque(JointTorques([10.0; 7]));
    bench.run(30);
    let push = Wrench {
        force_n: DVec3::new(-300.0, 0.0, 0.0),
        ..Wrench::default()
    };
    let mut step = bench.step_with(|b, _| b.force = Some(push));
    let mut last = 10.0;
    for _ in 0..12 {
        assert_eq!(step.state.name(), "compliant");
        let ArmCommand::Torque(torque) = step.command else {
            panic!("{step:?}");
        };
        assert!(
            (last - torque[2] - 1.0).abs() < 1e-9 || torque[2] == 0.0,
            "{torque:?}"
        );
        last = torque[2];
        step = bench.step();
    }
    assert_eq!(last, 0.0);
}

#[test]
fn torques_are_cut_in_size_and_rate() {
    let mut bench = Bench::new();
    bench.command = ArmCommand::Torque(JointTorques([1000.0, -1000.0, 0.5, 0.0, 0.0, 1000.0, 0.0]));
    // The first step has no time behind it.
    bench.step();
    let mut last = JointTorques::default();
    for i in 1..400 {
        let step = bench.step();
        let ArmCommand::Torque(torque) = step.command else {
            panic!("{step:?}");
        };
        for joint in 0..7 {
            assert!((torque[joint] - last[joint]).abs() <= 1.0 + 1e-9);
        }
        assert_eq!(step.state.name(), "slowed", "{i}");
        last = torque;
    }
    assert_eq!(
        (last[0], last[1], last[2], last[5]),
        (176.0, -176.0, 0.5, 40.0)
    );
}

#[test]
fn commands_are_cut_to_the_limits_of_joints() {
    let mut bench = Bench::new();
    bench.run(5);
    let mut beyond = home();
    beyond[0] += 0.4;
    bench.command = ArmCommand::Position(beyond);
    let most = SrsArm::iiwa7().max_velocity_rad_per_s()[0];
    let mut from = home();
    for _ in 0..50 {
        let step = bench.step();
        let ArmCommand::Position(q) = step.command else {
            panic!("{step:?}");
        };
        assert!((q[0] - from[0]).abs() <= most * DT_S * 1.001);
        assert_eq!(step.state.name(), "slowed");
        let SafeRequest::Go { speed_share } = step.request else {
            panic!("{step:?}");
        };
        assert!(speed_share < 1.0);
        (from, bench.state.q) = (q, q);
    }
    // Beyond the limit of an angle.
    let mut bench = Bench::new();
    let limit = SrsArm::iiwa7().limits()[6].max_rad;
    bench.state.q[6] = limit - 1e-4;
    let mut over = bench.state.q;
    over[6] = limit + 0.05;
    bench.command = ArmCommand::Position(over);
    let step = bench.run(3);
    let ArmCommand::Position(q) = step.command else {
        panic!("{step:?}");
    };
    assert!(q[6] <= limit);
    assert_eq!(step.state.reason().unwrap().name(), "command_limit");
}

#[test]
fn an_arm_beyond_its_limits_is_stopped_and_latched() {
    type Spoil = fn(&mut Bench);
    let spoils: [(Channel, Spoil); 3] = [
        (Channel::Position, |b| b.state.q[5] = 2.2),
        (Channel::Velocity, |b| b.state.qd[2] = 5.0),
        (Channel::Torque, |b| {
            b.state.external_torque = Some(JointTorques([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 41.0]))
        }),
    ];
    for (channel, spoil) in spoils {
        let mut bench = Bench::new();
        bench.run(2);
        // The leap into the fault is one by itself; after it the limit speaks.
        let step = bench.run_with(300, |b, _| spoil(b));
        let reason = step.state.reason().unwrap();
        assert_eq!(
            (reason.name(), reason.channel()),
            ("joint_limit", Some(channel))
        );
        assert!(step.latched);
        assert_eq!(
            bench.run_with(1000, |b, _| spoil(b)).state.name(),
            "stopped"
        );
        bench.run(100);
        bench.supervisor.reset();
        assert_eq!(bench.run(600).state, SafeState::Normal, "{channel:?}");
    }
}

#[test]
fn the_board_stays_in_its_box() {
    let arm = SrsArm::iiwa7();
    let at = arm.forward(&home()).position_m();
    let config = SupervisorConfig {
        guard: Some(GuardLimits {
            workspace: Some(WorkspaceBox {
                min_m: at - DVec3::splat(0.05),
                max_m: at + DVec3::splat(0.05),
            }),
            ..GuardLimits::of_arm(&arm)
        }),
        ..SupervisorConfig::default()
    };
    let mut bench = Bench::with(config);
    bench.run(5);
    let mut seen = None;
    for i in 0..300 {
        let mut q = home();
        q[0] += 1e-3 * f64::from(i);
        bench.command = ArmCommand::Position(q);
        let step = bench.step();
        if let SafeState::Holding { reason } = step.state {
            seen = Some(reason);
            break;
        }
        bench.state.q = q;
    }
    assert_eq!(seen, Some(SafeReason::Workspace));
}

/// A board that comes nearer to a finger, a head, or a hand that it would hit too hard is slowed down.
#[test]
fn near_a_person_the_board_is_slow() {
    let arm = SrsArm::iiwa7().carrying(Board::default().flange_from_board_face().unwrap());
    let face = arm.forward(&home());
    let normal = face.rotation().z_axis;
    let mut q = home();
    // Some joint motion that moves the face outwards at 1 m/s or so.
    let outward = |q: &JointPositions| arm.forward(q).position_m().dot(normal);
    let joint = 3;
    let mut ahead = q;
    ahead[joint] += 1e-6;
    let sign = (outward(&ahead) - outward(&q)).signum();
    let run = |part: PersonPart, distance_m: f64, q: &mut JointPositions| {
        let mut bench = Bench::new();
        bench.run(2);
        for point in &mut bench.person {
            if point.part == part {
                point.position_m = face.position_m() + normal * distance_m;
            }
        }
        // The leap of the point is a fault of its own.
        bench.run(300);
        q[joint] += sign * 2e-3;
        bench.command = ArmCommand::Position(*q);
        let step = bench.step();
        let ArmCommand::Position(out) = step.command else {
            panic!("{step:?}");
        };
        let speed = (outward(&out) - outward(&home())) / DT_S;
        *q = home();
        (step, speed)
    };
    let (step, free) = run(PersonPart::Fingertip, 2.0, &mut q);
    assert!(free > 0.35, "{free}");
    assert_eq!(step.state, SafeState::Normal);
    let (step, near) = run(PersonPart::Fingertip, 0.02, &mut q);
    assert!(near < 0.26, "{near}");
    assert_eq!(
        step.state.reason().unwrap().channel(),
        Some(Channel::Fingertip)
    );
    let (step, head) = run(PersonPart::Head, 0.4, &mut q);
    assert!(head < 0.26, "{head}");
    assert_eq!(step.state.reason().unwrap().name(), "person_near");
}

#[test]
fn a_retreat_goes_back_and_slowly() {
    let arm = SrsArm::iiwa7().carrying(Board::default().flange_from_board_face().unwrap());
    let normal = arm.forward(&home()).rotation().z_axis;
    for (sign, moves) in [(1.0, false), (-1.0, true)] {
        let mut bench = Bench::new();
        bench.run(5);
        let lost = |b: &mut Bench, _: &mut f64| b.person[0].stamp_s -= 1.0;
        let step = bench.run_with(350, lost);
        assert_eq!(step.state.name(), "retreating");
        let place = |q: &JointPositions| arm.forward(q).position_m();
        let mut ahead = home();
        ahead[3] += 1e-6;
        let outwards = (place(&ahead) - place(&home())).dot(normal).signum();
        let mut q = home();
        for _ in 0..20 {
            let mut to = q;
            to[3] += sign * outwards * 1e-3;
            bench.command = ArmCommand::Position(to);
            let step = bench.step_with(lost);
            let ArmCommand::Position(out) = step.command else {
                panic!("{step:?}");
            };
            let speed = place(&out).distance(place(&q)) / DT_S;
            assert!(speed <= 0.101, "{speed}");
            assert_eq!(speed > 0.05, moves, "{sign}: {speed}");
            (q, bench.state.q) = (out, out);
        }
    }
}

#[test]
fn a_stop_on_demand_lasts_until_it_is_reset() {
    let mut bench = Bench::new();
    bench.run(5);
    bench.supervisor.stop();
    let step = bench.run(5000);
    assert_eq!(
        step.state,
        SafeState::Stopped {
            reason: SafeReason::Requested
        }
    );
    assert!(step.latched && step.command == ArmCommand::Hold);
    bench.supervisor.reset();
    assert_eq!(bench.run(300).state, SafeState::Normal);
}

#[test]
fn an_edge_push_holds() {
    let mut bench = Bench::new();
    bench.run(5);
    let arm = SrsArm::iiwa7().carrying(Board::default().flange_from_board_face().unwrap());
    let face = arm.forward(&home());
    let force_n = face.transform_vector(DVec3::new(0.0, 0.0, -20.0));
    let lever = face.transform_vector(DVec3::new(0.11, 0.0, 0.0));
    let wrench = Wrench {
        force_n,
        moment_n_m: lever.cross(force_n),
    };
    let step = bench.step_with(|b, _| b.force = Some(wrench));
    assert_eq!(step.state.reason().unwrap().name(), "board_edge");
}

#[test]
fn settings_out_of_range_are_named() {
    type Change = fn(&mut SupervisorConfig);
    let bad: [(&str, Change); 7] = [
        ("quasi_static_n", |c| c.contact.quasi_static_n = 0.0),
        ("head_speed_m_per_s", |c| {
            c.person.head_speed_m_per_s = f64::NAN
        }),
        ("edge_m", |c| c.load.edge_m = -1.0),
        ("radius_m", |c| c.capsules.radius_m = 0.0),
        ("effective_mass_kg", |c| c.effective_mass_kg = -1.0),
        ("hold_s", |c| c.timing.hold_s = f64::INFINITY),
        ("max_age_s", |c| c.hand.max_age_s = 0.0),
    ];
    for (name, change) in bad {
        let mut config = SupervisorConfig::default();
        change(&mut config);
        let error = Supervisor::new(&SrsArm::iiwa7(), &Board::default(), config).unwrap_err();
        assert!(error.to_string().starts_with(name), "{name}: {error}");
    }
    let mut bench = Bench::new();
    assert!(bench.supervisor.set_effective_mass_kg(0.0).is_err());
    assert!(
        bench
            .supervisor
            .set_effective_mass_kg(f64::INFINITY)
            .is_ok()
    );
}

#[test]
fn no_cycle_allocates() {
    let mut bench = Bench::new();
    bench.run(5);
    let (state, person) = (bench.state, bench.person.clone());
    let supervisor = &mut bench.supervisor;
    let info = allocation_counter::measure(|| {
        for i in 0..500 {
            let bad = i % 50 == 7;
            let command = match i % 3 {
                0 => ArmCommand::Hold,
                1 => ArmCommand::Torque(JointTorques([1.0; 7])),
                _ => ArmCommand::Position(home()),
            };
            let input = SupervisorInput {
                now_s: if bad {
                    f64::NAN
                } else {
                    11.0 + 1e-3 * f64::from(i)
                },
                state: &state,
                person: &person,
                target: None,
                force: Some(Wrench::default()),
                command,
            };
            std::hint::black_box(supervisor.step(&input));
        }
    });
    assert_eq!(info.count_total, 0);
}
