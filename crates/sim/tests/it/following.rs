//! The simulated arm follows a feasible stream of commands with only its delay, and respects its limits otherwise.

use crate::common::torque::{moved, start};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{JointLimit, JointPositions, SrsArm};
use hwall_motion::{JointTiming, MotionConfig, MotionLimits, ReferenceMotion};
use hwall_sim::{ServoArm, ServoConfig};
use hwall_testkit::Sampler;
use std::sync::Arc;

const DELAY_S: f64 = 0.022;

fn servo() -> ServoArm {
    ServoArm::new(Arc::new(SrsArm::iiwa7()), start(), ServoConfig::default()).expect("valid")
}

/// The servo's own limits.
fn limits() -> MotionLimits {
    let config = MotionConfig {
        jerk_time_s: ServoConfig::default().jerk_time_s,
        ..MotionConfig::default()
    };
    MotionLimits::of_arm(&SrsArm::iiwa7(), &config).expect("valid")
}

/// Stopping distance of a joint from this speed, rad.
fn stop_rad(joint: usize, v: f64) -> f64 {
    let limits = limits();
    let (a, j) = (
        limits.acceleration_rad_per_s2[joint],
        limits.jerk_rad_per_s3[joint],
    );
    0.5 * v * (v / a + a / j)
}

/// A configuration within the range of every joint.
fn anywhere(sampler: &mut Sampler) -> JointPositions {
    let ranges = SrsArm::iiwa7().limits().map(|l| (l.min_rad, l.max_rad));
    JointPositions(sampler.array_within(ranges))
}

/// A motion at the arm's own limits, from rest.
fn motion_from(start: &JointPositions) -> ReferenceMotion {
    let model = SrsArm::iiwa7();
    let planned = MotionLimits::of_arm(&model, &MotionConfig::default()).expect("valid");
    ReferenceMotion::new(&model, &planned, start).expect("finite")
}

/// Angles at equal time steps, and their finite differences.
#[derive(Default)]
struct Track {
    q: Vec<[f64; 7]>,
}

impl Track {
    /// Runs a servo with `command(time, current position)` every millisecond.
    fn run(
        servo: &mut ServoArm,
        steps: usize,
        mut command: impl FnMut(f64) -> Option<ArmCommand>,
    ) -> Self {
        let mut track = Self {
            q: vec![servo.q().0],
        };
        for step in 0..steps {
            if let Some(command) = command(step as f64 * 1e-3) {
                servo.command(command).expect("accepted");
            }
            servo.advance(1e-3).expect("a step");
            track.q.push(servo.q().0);
            let (qd, most) = (servo.qd(), *servo.model().max_velocity_rad_per_s());
            assert!((0..7).all(|i| qd[i].abs() <= most[i]), "{qd:?}");
        }
        track
    }

    /// Largest speed, acceleration and jerk as fractions of the limits, by finite differences over 1 ms.
    fn shares(&self) -> [f64; 3] {
        let limits = limits();
        let mut most = [0.0_f64; 3];
        for i in 0..7 {
            let mut values: Vec<f64> = self.q.iter().map(|q| q[i]).collect();
            for (k, limit) in [
                limits.velocity_rad_per_s[i],
                limits.acceleration_rad_per_s2[i],
                limits.jerk_rad_per_s3[i],
            ]
            .into_iter()
            .enumerate()
            {
                values = values.windows(2).map(|w| (w[1] - w[0]) / 1e-3).collect();
                most[k] = values.iter().fold(most[k], |m, v| m.max(v.abs() / limit));
            }
        }
        most
    }

    /// Largest distance of a joint beyond its last angle, on the way from its first, rad.
    fn overshoot_rad(&self) -> f64 {
        let (first, last) = (self.q[0], self.q[self.q.len() - 1]);
        let over = |q: &[f64; 7], i: usize| (q[i] - last[i]) * (last[i] - first[i]).signum();
        let all = self.q.iter().flat_map(|q| (0..7).map(move |i| over(q, i)));
        all.fold(f64::NEG_INFINITY, f64::max)
    }

    fn assert_within_limits(&self, slack: f64) {
        let shares = self.shares();
        assert!(shares.iter().all(|s| *s <= 1.0 + slack), "{shares:?}");
    }
}

#[test]
fn a_step_arrives_in_the_least_time_without_overshoot() {
    let limits = limits();
    let mut sampler = Sampler::new(1);
    for round in 0..60 {
        let mut arm = servo();
        let reach = [1.0, 0.1, 1e-2, 1e-4][round % 4];
        let to = anywhere(&mut sampler);
        let goal = JointPositions(std::array::from_fn(|i| {
            start()[i] + reach * (to[i] - start()[i])
        }));
        arm.command(ArmCommand::Position(goal)).expect("accepted");
        let track = Track::run(&mut arm, 3000, |_| None);
        track.assert_within_limits(1e-6);
        assert_eq!(arm.q(), goal);
        let least_s = limits.travel_time_s(&start(), &goal);
        let late = track.q.iter().position(|q| *q == goal.0).expect("arrives") as f64 * 1e-3;
        assert!(late >= DELAY_S + least_s - 1e-9 && late <= DELAY_S + least_s + 1.01e-3);
        assert!(track.overshoot_rad() <= 1e-15);
        for q in &track.q {
            let back = |i: usize| (start()[i] - q[i]) * (goal[i] - start()[i]).signum();
            assert!((0..7).all(|i| back(i) <= 1e-15), "{q:?}");
        }
    }
}

#[test]
fn a_ramp_is_followed_with_the_delay_alone() {
    for share in [0.1, 0.3, 0.5, 1.0] {
        let mut arm = servo();
        let speeds = limits().velocity_rad_per_s;
        // Each joint moves in the direction with the larger range.
        let at = |t_s: f64| {
            let way = |i: usize| if start()[i] > 0.0 { -share } else { share };
            let q = |i: usize| start()[i] + way(i) * speeds[i] * t_s.clamp(0.0, 0.7);
            JointPositions(std::array::from_fn(q))
        };
        let track = Track::run(&mut arm, 720, |t_s| Some(ArmCommand::Position(at(t_s))));
        track.assert_within_limits(1e-4);
        // At full speed the servo cannot catch up: the initial lag remains.
        let lag_rad = |i: usize| match share < 1.0 {
            true => 0.0,
            false => stop_rad(i, speeds[i]),
        };
        for step in 600..720 {
            let asked = at(step as f64 * 1e-3 - DELAY_S);
            for i in 0..7 {
                let behind_rad = (track.q[step][i] - asked[i]).abs();
                let off_rad = behind_rad - lag_rad(i);
                assert!(off_rad.abs() < 1e-9, "{share}, joint {i}: {off_rad}");
            }
        }
    }
}

/// Largest deviation from the delayed command over a random feasible stream, rad; and the track.
fn following_error(period: usize, seed: u64, timing: JointTiming) -> (f64, Track) {
    let mut motion = motion_from(&start()).with_timing(timing);
    let mut sampler = Sampler::new(seed);
    let (mut arm, mut asked, mut worst, mut until) = (servo(), vec![start()], 0.0_f64, 0);
    let mut track = Track { q: vec![start().0] };
    for step in 0..40_000 {
        if step == until {
            motion.set_goal(&anywhere(&mut sampler)).expect("a motion");
            until += 1 + sampler.index(700);
        }
        if step % period == 0 {
            let command = ArmCommand::Position(motion.state().q);
            arm.command(command).expect("accepted");
        }
        asked.push(motion.step(1e-3).expect("a step").q);
        arm.advance(1e-3).expect("a step");
        track.q.push(arm.q().0);
        let delayed = asked[(step + 1_usize).saturating_sub(22)];
        worst = worst.max(arm.q().max_abs_difference(&delayed));
    }
    (worst, track)
}

#[test]
fn random_feasible_streams_are_followed() {
    for (period, most_rad) in [(1, 1e-9), (4, 1e-4), (8, 5e-4)] {
        for (seed, timing) in [
            (1, JointTiming::Together),
            (2, JointTiming::Soonest),
            (3, JointTiming::Straight),
        ] {
            let (worst, track) = following_error(period, seed, timing);
            assert!(worst < most_rad, "{period} ms: {worst}");
            track.assert_within_limits(0.05);
        }
    }
}

#[test]
fn an_infeasible_ramp_that_stops_is_not_overshot() {
    for share in [1.1, 1.5, 3.0, 100.0] {
        for duration_s in [0.05, 0.2, 0.35] {
            let mut arm = servo();
            let speeds = limits().velocity_rad_per_s;
            let at = |t_s: f64| {
                let q = |i: usize| {
                    let way = if start()[i] > 0.0 { -1.0 } else { 1.0 };
                    start()[i] + way * (share * speeds[i] * t_s.clamp(0.0, duration_s)).min(1.5)
                };
                JointPositions(std::array::from_fn(q))
            };
            let track = Track::run(&mut arm, 3000, |t_s| Some(ArmCommand::Position(at(t_s))));
            track.assert_within_limits(1e-6);
            let end = at(1.0);
            assert_eq!(arm.q(), end);
            let over = track.overshoot_rad();
            assert!(over <= 1e-9, "{share} for {duration_s} s: {over}");
        }
    }
}

#[test]
fn a_stream_caught_up_with_is_not_overshot_when_it_brakes() {
    // The servo lags by a jump at the start, and is still catching up when the stream brakes.
    for (share, behind_rad) in [(0.3, 0.3), (0.5, 0.1), (0.8, 0.05), (1.0, 0.02)] {
        let mut motion = motion_from(&moved(behind_rad));
        motion.set_speed_share(share).expect("a share");
        motion
            .set_goal(&moved(behind_rad + 0.45))
            .expect("a motion");
        let mut arm = servo();
        let track = Track::run(&mut arm, 3000, |_| {
            Some(ArmCommand::Position(motion.step(1e-3).expect("a step").q))
        });
        track.assert_within_limits(1e-6);
        assert_eq!(arm.q(), moved(behind_rad + 0.45));
        let over = track.overshoot_rad();
        assert!(over <= 1e-9, "{share}: {over}");
    }
}

#[test]
fn after_a_disturbance_the_stream_is_met_again_if_it_leaves_a_margin() {
    let model = SrsArm::iiwa7();
    let mut config = MotionConfig {
        speed_share: 0.95,
        ..MotionConfig::default()
    };
    config.acceleration_rad_per_s2 = config.acceleration_rad_per_s2.map(|a| 0.95 * a);
    let planned = MotionLimits::of_arm(&model, &config).expect("valid");
    let mut sampler = Sampler::new(8);
    let mut motion = ReferenceMotion::new(&model, &planned, &start()).expect("finite");
    let (mut arm, mut asked, mut off_rad) = (servo(), vec![start()], 0.0);
    let mut off_since = 0;
    for step in 0..20_000 {
        if step % 331 == 0 {
            let within = |l: JointLimit| sampler.uniform(l.min_rad + 0.01, l.max_rad - 0.01);
            let goal = JointPositions(model.limits().map(within));
            motion.set_goal(&goal).expect("a motion");
        }
        if step % 2500 == 1200 {
            // All commands jump by half a degree.
            off_rad = sampler.uniform(-0.01, 0.01);
        }
        let q = JointPositions(motion.state().q.0.map(|q| q + off_rad));
        arm.command(ArmCommand::Position(q)).expect("accepted");
        asked.push(q);
        motion.step(1e-3).expect("a step");
        arm.advance(1e-3).expect("a step");
        let delayed = asked[(step + 2_usize).saturating_sub(22)];
        let off = arm.q().max_abs_difference(&delayed);
        off_since = if off < 1e-9 { 0 } else { off_since + 1 };
        assert!(off_since < 900, "step {step}: {off} for {off_since} ms");
        assert!(off < 0.05, "step {step}: {off}");
    }
}

#[test]
fn limits_are_kept_whatever_is_commanded() {
    let model = SrsArm::iiwa7();
    let ranges = *model.limits();
    let walk = |from: &JointPositions, sampler: &mut Sampler, lo: f64, hi: f64| {
        JointPositions(std::array::from_fn(|i| {
            (from[i] + sampler.uniform(lo, hi)).clamp(ranges[i].min_rad, ranges[i].max_rad)
        }))
    };
    for seed in 0..4 {
        let mut sampler = Sampler::new(20 + seed);
        let mut arm = servo();
        let mut to = start();
        let track = Track::run(&mut arm, 20_000, |t_s| {
            // A different infeasible command pattern every second.
            match (t_s as usize + seed as usize) % 6 {
                0 => to = anywhere(&mut sampler),
                1 if sampler.index(50) == 0 => to = anywhere(&mut sampler),
                // A random walk that is faster than any joint.
                2 => to = walk(&to, &mut sampler, -0.05, 0.05),
                // Positions at the limits.
                3 if sampler.index(100) == 0 => {
                    to.0 = ranges.map(|l| if sampler.bool() { l.min_rad } else { l.max_rad });
                }
                4 if sampler.index(30) == 0 => return Some(ArmCommand::Hold),
                // Slow drift with noise.
                5 => to = walk(&to, &mut sampler, -1e-3, 1.2e-3),
                _ if sampler.bool() => return None,
                _ => {}
            }
            Some(ArmCommand::Position(to))
        });
        // Within a millisecond the speed may vary by an eighth of jerk times its square.
        track.assert_within_limits(1e-4);
        for q in &track.q {
            assert!((0..7).all(|i| ranges[i].contains(q[i])), "{q:?}");
        }
    }
}

#[test]
fn irregular_periods_and_a_late_command_are_followed_within_the_limits() {
    let mut sampler = Sampler::new(6);
    let mut motion = motion_from(&start());
    let (mut arm, mut fine) = (servo(), vec![start()]);
    let mut worst = [0.0_f64; 2];
    let (mut due_s, mut until_s) = (0.0, 0.0);
    for tick in 0..200_000_usize {
        // The motion in steps of 0.1 ms. Commands come every 0.1 to 8 ms, later every 1 ms with an occasional
        // delay of 15 ms.
        let t_s = tick as f64 * 1e-4;
        if t_s >= until_s {
            motion.set_goal(&anywhere(&mut sampler)).expect("a motion");
            until_s += sampler.uniform(0.1, 0.7);
        }
        let late = tick >= 100_000;
        if t_s >= due_s - 1e-9 {
            let command = ArmCommand::Position(motion.state().q);
            arm.command(command).expect("accepted");
            let pause_s = match late {
                false => (sampler.uniform(1e-4_f64.ln(), 8e-3_f64.ln())).exp(),
                true if sampler.index(200) == 0 => 16e-3,
                true => 1e-3,
            };
            due_s = t_s + pause_s;
        }
        fine.push(motion.step(1e-4).expect("a step").q);
        arm.advance(1e-4).expect("a step");
        let delayed = fine[(tick + 1).saturating_sub(220)];
        let off = arm.q().max_abs_difference(&delayed);
        worst[usize::from(late)] = worst[usize::from(late)].max(off);
    }
    assert!(worst[0] < 5e-4 && worst[1] < 1e-3, "{worst:?}");
}

#[test]
fn noise_on_a_stream_does_not_make_it_lag() {
    for (noise_rad, most_rad) in [(1e-6, 3e-5), (1e-5, 1e-3), (1e-4, 1e-2)] {
        let mut sampler = Sampler::new(7);
        let mut arm = servo();
        let at = |t_s: f64| moved(0.25 * (1.0 - (4.0 * t_s).cos()));
        let track = Track::run(&mut arm, 4000, |t_s| {
            let noisy = at(t_s).0.map(|q| q + noise_rad * sampler.normal());
            Some(ArmCommand::Position(JointPositions(noisy)))
        });
        track.assert_within_limits(1e-6);
        let off = |(step, q): (usize, &[f64; 7])| {
            let asked = at((step as f64 * 1e-3 - DELAY_S).max(0.0));
            asked.max_abs_difference(&JointPositions(*q))
        };
        let after_the_start = track.q.iter().enumerate().skip(500);
        let worst = after_the_start.map(off).fold(0.0, f64::max);
        assert!(worst < most_rad, "{noise_rad}: {worst}");
    }
}

#[test]
fn a_stream_that_ends_abruptly_is_come_back_to() {
    let mut arm = servo();
    let track = Track::run(&mut arm, 2500, |t_s| {
        (t_s < 0.6).then(|| ArmCommand::Position(moved(0.8 * t_s)))
    });
    track.assert_within_limits(1e-6);
    assert!((arm.q()[0] - moved(0.8 * 0.599)[0]).abs() < 1e-12);
    // The overshoot is at most the stopping distance from 0.8 rad/s.
    for i in 0..7 {
        let beyond = track.q.iter().map(|q| q[i] - arm.q()[i]);
        let most = beyond.fold(f64::NEG_INFINITY, f64::max);
        assert!(most <= stop_rad(i, 0.8) + 1e-4, "joint {i}: {most}");
    }
}

#[test]
fn nothing_is_allocated_after_construction() {
    let mut sampler = Sampler::new(9);
    let mut arm = servo();
    let goals: Vec<_> = (0..100).map(|_| anywhere(&mut sampler)).collect();
    let counted = allocation_counter::measure(|| {
        for step in 0..5000_usize {
            let goal = match step {
                ..2500 => moved(1e-4 * (step % 1000) as f64),
                _ => goals[step % 100],
            };
            arm.command(ArmCommand::Position(goal)).expect("accepted");
            arm.advance(1e-3).expect("a step");
            arm.state().expect("a state");
        }
        arm.command(ArmCommand::Hold).expect("accepted");
        arm.advance(1.0).expect("a step");
    });
    assert_eq!(counted.count_total, 0);
}
