//! The follower: exact arrival, branches kept, slack used.

use crate::support::{DT_S, home as start, iiwa as arm};
use glam::DVec3;
use hwall_haptics::{BoardTarget, Follower, FollowerConfig};
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_testkit::{Sampler, refusal, refused};
use std::sync::Arc;

fn follower(config: FollowerConfig) -> Follower {
    Follower::new(Arc::new(arm()), config, &start()).unwrap()
}

fn target(point_m: DVec3, normal: DVec3) -> BoardTarget {
    BoardTarget::new(point_m, normal, 0.0)
}

fn anywhere(s: &mut Sampler, arm: &SrsArm) -> JointPositions {
    let ranges = arm.limits().map(|limit| (limit.min_rad, limit.max_rad));
    JointPositions(s.array_within(ranges))
}

/// A random start, and a target that names its configuration.
fn way_to_anywhere(s: &mut Sampler, arm: &SrsArm) -> (JointPositions, BoardTarget) {
    let [from, near] = [(); 2].map(|()| anywhere(s, arm));
    let face = arm.forward(&near);
    let exact = BoardTarget {
        near: Some(near),
        ..target(face.position_m(), face.rotation().z_axis)
    };
    (from, exact)
}

/// The board's pose in a random configuration: reachable, anywhere within the limits.
fn reachable(s: &mut Sampler, arm: &SrsArm) -> BoardTarget {
    let pose = arm.forward(&anywhere(s, arm));
    target(pose.position_m(), pose.rotation().z_axis)
}

#[test]
fn arrives_exactly_and_stays() {
    let mut s = Sampler::new(22);
    let arm = arm();
    let mut f = follower(FollowerConfig::default());
    for _ in 0..50 {
        let aim = reachable(&mut s, &arm);
        assert_eq!(f.aim(&aim).unwrap(), None);
        let goal = f.goal().unwrap();
        let from = f.commanded();
        for _ in 0..600 {
            assert_eq!(f.aim(&aim).unwrap(), None);
            let q = f.step(0.01).unwrap();
            for j in 0..7 {
                let (lo, hi) = (from[j].min(goal[j]), from[j].max(goal[j]));
                let between = (lo - 1e-14..=hi + 1e-14).contains(&q[j]);
                assert!(between, "overshoot of joint {j}");
            }
        }
        assert_eq!((f.commanded(), f.goal().unwrap()), (goal, goal));
        assert_eq!(f.commanded_velocity().0, [0.0; 7]);
        let pose = arm.forward(&goal);
        assert!(pose.position_m().distance(aim.point_m) < 1e-11);
        assert!(pose.rotation().z_axis.distance(aim.normal) < 1e-11);
    }
}

#[test]
fn a_drifting_target_never_jumps() {
    let mut s = Sampler::new(23);
    let normal = DVec3::new(1.0, 0.2, 0.1);
    let mut f = follower(FollowerConfig::default());
    let mut point_m = DVec3::new(0.55, 0.0, 0.5);
    f.aim(&target(point_m, normal)).unwrap();
    let (mut before, mut largest) = (f.goal().unwrap(), 0.0_f64);
    for _ in 0..20_000 {
        let step = s.unit_vector() * 0.002;
        let next = point_m + step;
        // A patch below the height at which shoulder and wrist are both singular.
        point_m = next.clamp(DVec3::new(0.5, -0.2, 0.35), DVec3::new(0.6, 0.2, 0.6));
        assert_eq!(f.aim(&target(point_m, normal)).unwrap(), None);
        f.step(DT_S).unwrap();
        let goal = f.goal().unwrap();
        largest = largest.max(goal.max_abs_difference(&before));
        before = goal;
    }
    println!("2 mm moved a joint by at most {largest} rad");
    assert!(largest < 0.05);
}

#[test]
fn quarter_turns_reduce_the_travel() {
    let mut s = Sampler::new(24);
    let arm = arm();
    let limits = *follower(FollowerConfig::default()).limits();
    let mut fixed = follower(FollowerConfig {
        rolls_rad: vec![0.0],
        ..FollowerConfig::default()
    });
    let mut turning = follower(FollowerConfig::default());
    let time = |f: &mut Follower, from: &JointPositions, aim: &BoardTarget| {
        f.restart(from, &Default::default()).unwrap();
        let verdict = f.aim(aim).unwrap();
        f.goal()
            .map(|goal| limits.travel_time_s(from, &goal))
            .ok_or(verdict)
    };
    let (mut sum_fixed, mut sum_turning, mut compared, mut rescued) = (0.0, 0.0, 0, 0);
    for _ in 0..500 {
        let from = anywhere(&mut s, &arm);
        let aim = reachable(&mut s, &arm);
        let [one, four] = [&mut fixed, &mut turning].map(|f| time(f, &from, &aim));
        match (one, four) {
            (Ok(one), Ok(four)) => {
                assert!(four <= one + 1e-12, "{four} s against {one} s");
                (sum_fixed, sum_turning) = (sum_fixed + one, sum_turning + four);
                compared += 1;
            }
            (Err(_), Ok(_)) => rescued += 1,
            // A pose reachable at some roll may be unreachable at the four rolls tried.
            (_, Err(reason)) => assert!(reason.is_some()),
        }
    }
    println!(
        "{compared} targets in {sum_fixed:.1} s, turning {sum_turning:.1} s; {rescued} only so"
    );
    assert!(compared > 300 && sum_turning < 0.95 * sum_fixed);
}

/// With slack the goal may use another place and another elbow position, never a later one, and always one that presents the target.
#[test]
fn slack_is_used_to_be_there_sooner() {
    let mut s = Sampler::new(25);
    let arm = arm();
    let limits = *follower(FollowerConfig::default()).limits();
    let [mut sum_exact_s, mut sum_slack_s] = [0.0; 2];
    let (mut compared, mut other_elbow) = (0, 0);
    for k in 0..300 {
        let (from, exact) = way_to_anywhere(&mut s, &arm);
        let slack_m = [s.uniform(0.01, 0.05), s.uniform(0.01, 0.05)];
        let goal = |aim: &BoardTarget| {
            let mut f = follower(FollowerConfig::default());
            f.restart(&from, &Default::default()).unwrap();
            f.aim(aim).unwrap();
            f.goal()
        };
        let slack = BoardTarget { slack_m, ..exact };
        let (Some(at), Some(off)) = (goal(&exact), goal(&slack)) else {
            continue;
        };
        let [at_s, off_s] = [at, off].map(|q| limits.travel_time_s(&from, &q));
        assert!(off_s <= at_s + 1e-12, "{k}: {off_s} s against {at_s} s");
        let pose = arm.forward(&off);
        let axes = hwall_haptics::surface_axes(exact.normal).unwrap();
        let away = pose.position_m() - exact.point_m;
        let share = |i: usize| away.dot(axes[i]) / slack_m[i];
        assert!(share(0).hypot(share(1)) <= 1.0 + 1e-9, "{k}: {away}");
        assert!(away.dot(exact.normal).abs() < 1e-9, "{k}: {away}");
        assert!(pose.rotation().z_axis.angle_between(exact.normal) < 1e-6);
        (sum_exact_s, sum_slack_s) = (sum_exact_s + at_s, sum_slack_s + off_s);
        compared += 1;
        other_elbow += usize::from(off != at);
    }
    println!("{compared} targets: {sum_exact_s:.1} s exactly, {sum_slack_s:.1} s with slack");
    assert!(compared > 150 && other_elbow > compared / 2);
    assert!(sum_slack_s < 0.97 * sum_exact_s);
}

/// A point that becomes known better adds slack during the motion: the goal stays, unless the hand is first.
#[test]
fn a_goal_moves_within_a_grown_slack_only_for_a_hand_that_is_first() {
    let mut s = Sampler::new(26);
    let arm = arm();
    let (mut sum_kept_s, mut sum_sooner_s) = (0.0, 0.0);
    let (mut compared, mut later) = (0, 0);
    for k in 0..200 {
        let (from, exact) = way_to_anywhere(&mut s, &arm);
        let grown = BoardTarget {
            slack_m: [0.04; 2],
            ..exact
        };
        let under_way = || {
            let mut f = follower(FollowerConfig::default());
            f.restart(&from, &Default::default()).unwrap();
            f.aim(&exact).unwrap();
            let at = f.goal()?;
            for _ in 0..50 {
                f.step(0.001).unwrap();
            }
            f.aim(&grown).unwrap();
            assert_eq!(f.goal(), Some(at), "{k}: nobody hurries");
            Some(f)
        };
        let (Some(mut kept), Some(mut hurried)) = (under_way(), under_way()) else {
            continue;
        };
        // Never beyond the slack, whatever is requested.
        let first = BoardTarget {
            sooner_within_m: Some([0.4; 2]),
            ..grown
        };
        hurried.aim(&first).unwrap();
        let sooner = hurried.goal().expect("one was set");
        let off = arm.forward(&sooner).position_m() - exact.point_m;
        assert!(off.length() <= 0.04 + 1e-9, "{k}: {off}");
        assert!(off.dot(exact.normal).abs() < 1e-9, "{k}: {off}");
        // Not repeatedly: the same slack contains nothing new, even slightly further from the point.
        let again = BoardTarget {
            stamp_s: 0.001,
            point_m: exact.point_m - off * 0.1,
            ..first
        };
        hurried.aim(&again).unwrap();
        assert_eq!(hurried.goal(), Some(sooner), "{k}");
        // The board itself arrives sooner, not only its joints one by one.
        let [kept_s, sooner_s] = [&mut kept, &mut hurried].map(|f| {
            let mut steps = 0;
            while f.left_s().expect("a goal") > 0.0 && steps < 10_000 {
                f.step(0.001).unwrap();
                f.plan();
                steps += 1;
            }
            1e-3 * f64::from(steps)
        });
        later += usize::from(sooner_s > kept_s + 2e-3);
        (sum_kept_s, sum_sooner_s) = (sum_kept_s + kept_s, sum_sooner_s + sooner_s);
        compared += 1;
    }
    println!("{compared} goals: {sum_kept_s:.1} s kept, {sum_sooner_s:.1} s moved, {later} later");
    assert!(compared > 100 && later <= compared / 50, "{later} later");
    assert!(sum_sooner_s < 0.98 * sum_kept_s);
}

/// A place out of reach is served by a nearby centre of the board, if the slack contains one that can be presented.
#[test]
fn slack_serves_a_place_that_cannot_be_held_itself() {
    let arm = arm();
    let place = |z_m: f64| target(DVec3::new(0.6, 0.1, z_m), DVec3::X);
    let held = |aim: &BoardTarget| {
        let mut f = follower(FollowerConfig::default());
        let unreachable = f.aim(aim).unwrap();
        (f.goal(), unreachable)
    };
    let mut last = None;
    let mut heights_m = (0..200).map(|k| 0.6 + 0.005 * f64::from(k));
    let above_m = heights_m.find(|z_m| match held(&place(*z_m)).0 {
        Some(goal) => {
            last = Some(goal);
            false
        }
        None => true,
    });
    let above_m = above_m.expect("the arm ends somewhere");
    let near = last.expect("the first height is within reach");
    for (slack_m, serves) in [(0.0, false), (0.04, true)] {
        let aim = BoardTarget {
            near: Some(near),
            slack_m: [slack_m; 2],
            ..place(above_m + 0.01)
        };
        let (goal, unreachable) = held(&aim);
        assert_eq!((goal.is_some(), unreachable.is_none()), (serves, serves));
        let Some(goal) = goal else { continue };
        let pose = arm.forward(&goal);
        let off = pose.position_m() - aim.point_m;
        assert!(off.length() <= slack_m && off.x.abs() < 1e-9, "{off}");
        assert!(pose.rotation().z_axis.angle_between(DVec3::X) < 1e-6);
    }
}

#[test]
fn bad_targets_and_steps_are_named_and_change_nothing() {
    let mut f = follower(FollowerConfig::default());
    f.aim(&target(DVec3::new(0.55, 0.1, 0.6), DVec3::X))
        .unwrap();
    f.step(0.1).unwrap();
    let (goal, commanded) = (f.goal(), f.commanded());
    for (point_m, normal, named) in [
        (DVec3::NAN, DVec3::X, "point_m[0] is NaN"),
        (DVec3::X, DVec3::NAN, "normal[0] is NaN"),
        (DVec3::X, DVec3::ZERO, "no direction"),
    ] {
        let said = refusal(f.set_target(&target(point_m, normal)));
        assert!(said.contains(named), "{said}");
    }
    for bad in [f64::NAN, f64::INFINITY, -0.01] {
        let aim = BoardTarget {
            sooner_within_m: Some([0.02, bad]),
            ..target(DVec3::new(0.6, 0.1, 0.6), DVec3::X)
        };
        assert!(f.set_target(&aim).is_err(), "{bad}");
    }
    for dt_s in [-1e-3, f64::NAN, f64::INFINITY] {
        assert!(f.step(dt_s).is_err() && f.brake(dt_s).is_err());
    }
    let nowhere = JointPositions([f64::NAN; 7]);
    assert!(f.restart(&nowhere, &Default::default()).is_err());
    assert_eq!((f.goal(), f.commanded()), (goal, commanded));
}

#[test]
fn settings_out_of_range_are_named() {
    let make = |config| Follower::new(Arc::new(arm()), config, &start());
    refused!(FollowerConfig::default(), make, {
        rolls_rad = Vec::new() => "number of rolls";
        rolls_rad = vec![f64::NAN];
        far_m = -1.0;
        far_rad = f64::NAN;
    });
}

#[test]
fn limits_hold_at_each_of_100_000_steps_while_the_goal_moves() {
    let mut s = Sampler::new(21);
    let mut f = follower(FollowerConfig::default());
    let arm = arm();
    let limits = *f.limits();
    let most_speed = limits.velocity_rad_per_s;
    let mut aim = reachable(&mut s, &arm);
    let (mut before, mut speed_before, mut fastest) = (start(), [0.0; 7], 0.0_f64);
    for i in 0..100_000 {
        if s.uniform(0.0, 1.0) < 0.01 {
            aim = reachable(&mut s, &arm);
        } else if i % 8 == 0 {
            aim.point_m += s.unit_vector() * 0.01;
        }
        f.aim(&aim).unwrap();
        let q = f.step(DT_S).unwrap();
        for j in 0..7 {
            let speed = (q[j] - before[j]) / DT_S;
            assert!(
                // Differences over a millisecond of positions with an error of 1e-11 rad.
                speed.abs() <= most_speed[j] + 1e-8,
                "step {i} joint {j}: {speed} rad/s"
            );
            let acceleration = (speed - speed_before[j]) / DT_S;
            assert!(
                acceleration.abs() <= limits.acceleration_rad_per_s2[j] + 1e-6,
                "step {i} joint {j}: {acceleration} rad/s²"
            );
            assert!(
                arm.limits()[j].contains(q[j]),
                "step {i} joint {j}: {} rad",
                q[j]
            );
            fastest = fastest.max(speed.abs() / most_speed[j]);
            speed_before[j] = speed;
        }
        before = q;
    }
    assert!(fastest > 0.99, "the test must reach the limits");
}
