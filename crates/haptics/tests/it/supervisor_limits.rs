//! Every limit of the supervisor, one by one.

use crate::supervised::Bench;
use crate::support::{DT_S, force, home, iiwa, outwards, positions, rates, unpressed};
use glam::DVec3;
use hwall_haptics::body::{ArmBody, BodyConfig, Room};
use hwall_haptics::safety::{
    Channel, GuardLimits, PersonPart, SafeReason, SafeRequest, SafeState, Supervisor,
    SupervisorConfig, WorkspaceBox,
};
use hwall_haptics::{ArmCommand, Board};
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, SrsArm, SrsParameters, Wrench,
};
use hwall_testkit::{Sampler, refused};

#[test]
fn too_much_force_withdraws_at_once_and_is_latched() {
    let push = |force_n: f64| force(DVec3::NEG_X * force_n);
    let mut bench = Bench::after(10);
    // An impact within the limit is allowed for half a second.
    let normal = bench.run_with(450, |b, _| b.force = Some(push(200.0)));
    assert_eq!(normal.state, SafeState::Normal);
    let lasting = bench.run_with(60, |b, _| b.force = Some(push(200.0)));
    assert_eq!(lasting.state.name(), "retreating");
    assert!(lasting.latched && matches!(lasting.request, SafeRequest::Yield { .. }));
    let SafeReason::Force { limit_n, .. } = lasting.state.reason().unwrap() else {
        panic!("{lasting:?}");
    };
    assert_eq!(limit_n, 140.0);
    // The force is gone, but latched: the supervisor ends in stopped, until it is reset.
    let last = bench.run(3000);
    assert_eq!((last.state.name(), last.latched), ("stopped", true));
    bench.supervisor.reset();
    assert_eq!(bench.run(300).state, SafeState::Normal);

    let mut bench = Bench::after(10);
    let hit = bench.step_with(|b, _| b.force = Some(push(300.0)));
    assert_eq!(hit.state.name(), "retreating");
    let mut bench = Bench::after(10);
    let broken = bench.step_with(|b, _| b.force = Some(push(5000.0)));
    assert_eq!((broken.state.name(), broken.latched), ("holding", true));
    assert_eq!(broken.state.reason().unwrap().name(), "implausible_force");
    assert_eq!(bench.run(400).state.name(), "holding");
    let stopped = bench.run_with(400, |b, _| b.force = Some(push(5000.0)));
    assert_eq!(stopped.state.name(), "stopped");
}

/// A torque-controlled arm yields instead, as fast as torques may change, for as long as it is pressed.
#[test]
fn too_much_force_on_a_torque_arm_makes_it_float() {
    let mut bench = Bench::new();
    bench.command = ArmCommand::Torque(JointTorques([10.0; 7]));
    bench.run(30);
    let push = force(DVec3::NEG_X * 300.0);
    let mut step = bench.step_with(|b, _| b.force = Some(push));
    let mut last = 10.0;
    for _ in 0..12 {
        assert_eq!(step.state.name(), "compliant");
        let ArmCommand::Torque(torque) = step.command else {
            panic!("{step:?}");
        };
        let fell_n_m = last - torque[2];
        let is_rate = (fell_n_m - 1.0).abs() < 1e-9;
        assert!(is_rate || torque[2] == 0.0, "{torque:?}");
        last = torque[2];
        step = bench.step_with(|b, _| b.force = Some(push));
    }
    assert_eq!(last, 0.0);
    assert_eq!(bench.step().state.name(), "holding");
}

#[test]
fn torques_are_cut_in_size_and_rate() {
    let mut bench = Bench::new();
    bench.command = ArmCommand::Torque(JointTorques([1000.0, -1000.0, 0.5, 0.0, 0.0, 1000.0, 0.0]));
    // The first step has zero duration.
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
    let reached = [0, 1, 2, 5].map(|joint| last[joint]);
    assert_eq!(reached, [176.0, -176.0, 0.5, 40.0]);
}

#[test]
fn commands_are_cut_to_the_limits_of_joints() {
    let mut bench = Bench::after(5);
    let mut beyond = home();
    beyond[0] += 0.4;
    bench.command = ArmCommand::Position(beyond);
    let most = SrsArm::iiwa7().max_velocity_rad_per_s()[0];
    let hardest = GuardLimits::of_arm(&SrsArm::iiwa7()).acceleration_rad_per_s2[0];
    let (mut from, mut speed) = (home(), 0.0);
    for k in 0..5000 {
        let step = bench.step();
        let q = positions(step.command);
        let now = (q[0] - from[0]) / DT_S;
        assert!(now.abs() <= most * 1.001);
        assert!((now - speed).abs() <= hardest * DT_S * (1.0 + 1e-6), "{k}");
        let SafeRequest::Go { speed_share } = step.request else {
            panic!("{step:?}");
        };
        // Requested once; it stays slowed while the arm catches up.
        assert_eq!(speed_share < 1.0, k == 0);
        assert!(k > 50 || step.state.name() == "slowed");
        (from, bench.state.q, speed) = (q, q, now);
    }
    assert!((from[0] - beyond[0]).abs() < 1e-9, "{from:?}");
    // Beyond an angle limit.
    let mut bench = Bench::new();
    let limit = SrsArm::iiwa7().limits()[6].max_rad;
    bench.state.q[6] = limit - 1e-4;
    let mut over = bench.state.q;
    over[6] = limit + 0.05;
    bench.command = ArmCommand::Position(over);
    let step = bench.run(3);
    let q = positions(step.command);
    assert!(q[6] <= limit);
    assert_eq!(step.state.reason().unwrap().name(), "command_limit");
}

#[test]
fn an_arm_beyond_its_limits_is_stopped_and_latched() {
    type Spoil = fn(&mut Bench);
    let spoils: [(Channel, Spoil); 2] = [
        (Channel::Position, |b| b.state.q[5] = 2.2),
        (Channel::Velocity, |b| b.state.qd[2] = 5.0),
    ];
    for (channel, spoil) in spoils {
        let mut bench = Bench::after(2);
        // The jump into the fault is a fault of its own; after it the limit is reported.
        let step = bench.run_with(300, |b, _| spoil(b));
        let reason = step.state.reason().unwrap();
        assert_eq!(reason.name(), "joint_limit");
        assert_eq!(reason.channel(), Some(channel));
        assert!(step.latched);
        let stopped = bench.run_with(1000, |b, _| spoil(b));
        assert_eq!(stopped.state.name(), "stopped");
        bench.run(100);
        bench.supervisor.reset();
        assert_eq!(bench.run(600).state, SafeState::Normal, "{channel:?}");
    }
}

/// A board that approaches a finger, a head, or a hand that it would hit too hard is slowed down.
#[test]
fn near_a_person_the_board_is_slow() {
    let arm = iiwa();
    let face = arm.forward(&home());
    let normal = face.rotation().z_axis;
    let outward = |q: &JointPositions| arm.forward(q).position_m().dot(normal);
    let run = |part: PersonPart, distance_m: f64| {
        let mut bench = Bench::after(2);
        for point in &mut bench.person {
            if point.part == part {
                point.position_m = face.position_m() + normal * distance_m;
            }
        }
        // The jump of the point is a fault of its own.
        bench.run(300);
        // Any joint motion that moves the face outwards at about 1 m/s.
        let mut q = home();
        q[3] += outwards(&arm, 3) * 2e-3;
        bench.command = ArmCommand::Position(q);
        let step = bench.step();
        let out = positions(step.command);
        let speed = (outward(&out) - outward(&home())) / DT_S;
        (step, speed)
    };
    let (step, free) = run(PersonPart::Fingertip, 2.0);
    assert!(free > 0.35, "{free}");
    assert_eq!(step.state, SafeState::Normal);
    let (step, near) = run(PersonPart::Fingertip, 0.02);
    assert!(near < 0.26, "{near}");
    let reason = step.state.reason().unwrap();
    assert_eq!(reason.channel(), Some(Channel::Fingertip));
    let (step, head) = run(PersonPart::Head, 0.4);
    assert!(head < 0.26, "{head}");
    assert_eq!(step.state.reason().unwrap().name(), "person_near");
}

#[test]
fn a_retreat_goes_back_and_slowly() {
    let arm = iiwa();
    let place = |q: &JointPositions| arm.forward(q).position_m();
    for (sign, moves) in [(1.0, false), (-1.0, true)] {
        let mut bench = Bench::after(5);
        let lost = |b: &mut Bench, _: &mut f64| b.person[0].stamp_s -= 1.0;
        let step = bench.run_with(350, lost);
        assert_eq!(step.state.name(), "retreating");
        let (mut q, mut to) = (home(), home());
        for k in 0..60 {
            to[3] += sign * outwards(&arm, 3) * 1e-3;
            bench.command = ArmCommand::Position(to);
            let step = bench.step_with(lost);
            let out = positions(step.command);
            let speed = place(&out).distance(place(&q)) / DT_S;
            assert!(speed <= 0.101, "{speed}");
            // It takes time to reach that speed.
            assert!(k < 30 || (speed > 0.05) == moves, "{sign}: {speed}");
            (q, bench.state.q) = (out, out);
        }
    }
}

#[test]
fn an_edge_push_holds() {
    let mut bench = Bench::after(5);
    let arm = iiwa();
    let face = arm.forward(&home());
    let force_n = face.transform_vector(DVec3::new(0.0, 0.0, -20.0));
    let lever = face.transform_vector(DVec3::new(0.11, 0.0, 0.0));
    let wrench = Wrench {
        force_n,
        moment_n_m: lever.cross(force_n),
    };
    // Located after the filter: a 20 N step exceeds 10 N within 35 ms.
    bench.force = Some(wrench);
    let step = bench.run(36);
    assert_eq!(step.state.reason().unwrap().name(), "board_edge");
}

#[test]
fn settings_out_of_range_are_named() {
    let make = |config| Supervisor::new(&SrsArm::iiwa7(), &Board::default(), config);
    refused!(SupervisorConfig::default(), make, {
        contact.quasi_static_n = 0.0;
        separation.person_m_per_s = f64::NAN;
        load.edge_m = -1.0;
        body.radius_m = 0.0;
        effective_mass_kg = -1.0;
        timing.hold_s = f64::INFINITY;
        hand.max_age_s = 0.0;
    });
    let mut bench = Bench::new();
    let supervisor = &mut bench.supervisor;
    assert!(supervisor.set_effective_mass_kg(0.0).is_err());
    assert!(supervisor.set_effective_mass_kg(f64::INFINITY).is_ok());
}

#[test]
fn no_cycle_allocates() {
    let mut bench = Bench::after(5);
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
            let now_s = if bad {
                f64::NAN
            } else {
                11.0 + 1e-3 * f64::from(i)
            };
            let input = unpressed(now_s, &state, &person, command);
            std::hint::black_box(supervisor.step(&input));
        }
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn the_first_command_waits_for_states_that_agree() {
    for count in [1, 3, 5] {
        let mut bench = Bench::as_configured(SupervisorConfig {
            agreeing_states: count,
            ..SupervisorConfig::default()
        });
        for k in 1..10 {
            let step = bench.step();
            let reason = SafeReason::Unproven;
            let waits = step.state == SafeState::Holding { reason };
            assert_eq!(waits, k < count, "{k} of {count}");
            assert_eq!(waits, step.command == ArmCommand::Hold);
        }
    }
    // A state that disagrees restarts the count.
    let mut bench = Bench::as_configured(SupervisorConfig::default());
    bench.run_with(1, |bench, _| bench.state.q[1] += 1.0);
    assert_eq!(bench.step().command, ArmCommand::Hold);
}

#[test]
fn a_target_that_flips_every_step_is_noticed_and_one_that_changes_now_and_then_is_not() {
    let mut bench = Bench::new();
    let mut noticed = None;
    for k in 0..200 {
        bench.target = Some(DVec3::new(0.6, if k % 2 == 0 { -0.2 } else { 0.2 }, 0.6));
        if let SafeState::Holding { reason } = bench.step().state {
            let SafeReason::Jump { channel, by } = reason else {
                panic!("{reason:?}");
            };
            assert!(channel == Channel::Target && by > 0.39);
            noticed = noticed.or(Some(k));
        }
    }
    assert!(noticed.is_some_and(|k| k < 40), "{noticed:?}");
    // It ends once the target is still.
    bench.target = Some(DVec3::new(0.6, 0.0, 0.6));
    assert_eq!(bench.run(4000).state, SafeState::Normal);
    for k in 0..5000 {
        // A person who looks from one thing to the next five times a second.
        bench.target = Some(DVec3::new(0.6, 0.2 * f64::from(k / 200 % 2), 0.6));
        assert_eq!(bench.step().state, SafeState::Normal, "{k}");
    }
}

#[test]
fn targets_below_the_table_or_inside_the_base_get_no_command() {
    let arm = SrsArm::iiwa7();
    let table = WorkspaceBox {
        min_m: DVec3::new(-1.0, -1.0, 0.15),
        max_m: DVec3::new(1.0, 1.0, 1.5),
    };
    // Straight down from home towards below the table, and folded into its own base.
    let below = JointPositions::from_deg([0.0, 95.0, 0.0, -60.0, 0.0, 60.0, 0.0]);
    let board = Board::default();
    let carrying = ArmKinematics::carrying(&arm, board.flange_from_board_face().unwrap());
    let body = ArmBody::new(carrying, board, BodyConfig::default()).unwrap();
    let mut sampler = Sampler::new(3);
    let inside = std::iter::repeat_with(|| {
        JointPositions(arm.limits().map(|l| sampler.uniform(l.min_rad, l.max_rad)))
    })
    .find(|q| body.nearest(q).distance_m < -0.05);
    // Only the command counts here; nobody is near.
    for (to, reason) in [(below, "workspace"), (inside.unwrap(), "self_collision")] {
        let mut bench = Bench::with(SupervisorConfig {
            guard: Some(GuardLimits {
                workspace: (to == below).then_some(table),
                ..GuardLimits::of_arm(&arm)
            }),
            // Without a floor, which would be reported first.
            room: Some(Room::new(&[]).unwrap()),
            ..SupervisorConfig::default()
        });
        let from = home();
        let mut named = None;
        for k in 0..4000 {
            let share = f64::from(k) / 4000.0;
            let wanted = std::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
            bench.command = ArmCommand::Position(JointPositions(wanted));
            let said = bench.step();
            if let ArmCommand::Position(q) = said.command {
                bench.state.qd = rates(&bench.state.q, &q);
                bench.state.q = q;
            } else {
                named = said.state.reason().map(|reason| reason.name());
                break;
            }
        }
        assert_eq!(named, Some(reason));
    }
}

/// The bias is found although the hand was lost before, and becomes the reported fault.
#[test]
fn a_bias_is_found_whatever_else_is_wrong() {
    let mut bench = Bench::new();
    bench.supervisor.set_out_of_reach(true);
    bench.run(20);
    let mut named = None;
    for _ in 0..2000 {
        let step = bench.step_with(|bench, _| {
            bench.person.clear();
            let mut torque = JointTorques::default();
            torque[1] = 20.0;
            bench.state.external_torque = Some(torque);
        });
        if let Some(SafeReason::TorqueBias { joint, bias_n_m }) = step.state.reason() {
            named = Some((joint, bias_n_m));
        }
    }
    let (joint, bias_n_m) = named.expect("it is named");
    assert!(joint == 1 && (bias_n_m - 20.0).abs() < 1e-9, "{bias_n_m}");
}

#[test]
fn an_unknown_torque_limit_is_a_hand_pressed_at_the_length_of_the_arm() {
    let known = SrsArm::iiwa7();
    let of = |p: &SrsParameters| SrsParameters::new(p.geometry, p.limits, p.max_velocity_rad_per_s);
    let unknown = SrsArm::new(of(known.parameters())).unwrap();
    let g = known.geometry();
    let longest_m = g.d_se_m + g.d_ew_m + g.d_wf_m;
    let limits_n_m = GuardLimits::of_arm(&unknown).torque_n_m;
    // The tool point is on the axis of joint 7, and at most the length of the arm from the shoulder axes.
    assert!((limits_n_m[6] - 140.0 * 0.1).abs() < 1e-9, "{limits_n_m:?}");
    for joint in [0, 1] {
        let lever_m = limits_n_m[joint] / 140.0 - 0.1;
        let is_arm = (0.8 * longest_m..=longest_m + 1e-9).contains(&lever_m);
        assert!(is_arm, "{lever_m}");
    }
    assert_eq!(GuardLimits::of_arm(&known).torque_n_m[0], 176.0);
    // A description that states an absurd limit does not switch the check off.
    let mut absurd = of(known.parameters());
    absurd.max_torque_n_m = [1e4; 7];
    let limits_n_m = GuardLimits::of_arm(&SrsArm::new(absurd).unwrap()).torque_n_m;
    let most_n_m = 2.0 * 140.0 * (longest_m + 0.1);
    let all_below = limits_n_m.iter().all(|n_m| *n_m <= most_n_m);
    assert!(all_below, "{limits_n_m:?}");
    let wrist_n_m = 4.0 * 140.0 * 0.1;
    assert!((limits_n_m[6] - wrist_n_m).abs() < 1e-9, "{limits_n_m:?}");
}
