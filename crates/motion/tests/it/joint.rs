//! The motion of a single joint: least time, limits, exact arrival, any start.

use hwall_motion::{JointBounds, JointPoint};
use hwall_testkit::Sampler;

const LIMITS: [f64; 3] = [1.7, 8.0, 400.0];

fn bounds() -> JointBounds {
    JointBounds::new(LIMITS[0], LIMITS[1], LIMITS[2]).expect("valid")
}

/// A state from which the bounds can be kept.
fn random_state(sampler: &mut Sampler) -> JointPoint {
    loop {
        let point = JointPoint::new(
            sampler.uniform(-1.0, 1.0),
            sampler.uniform(-LIMITS[0], LIMITS[0]),
            sampler.uniform(-LIMITS[1], LIMITS[1]),
        );
        if point.coming_velocity_rad_per_s(&bounds()).abs() <= LIMITS[0] {
            return point;
        }
    }
}

/// Moves to rest at the goal in random steps up to a length; returns the time, and the largest speed, acceleration and jerk as shares of the limits.
fn run(start: JointPoint, goal: f64, most_dt_s: f64, sampler: &mut Sampler) -> (f64, [f64; 3]) {
    let bounds = bounds();
    let (mut at, mut t_s, mut most) = (start, 0.0, [0.0_f64; 3]);
    while at != JointPoint::at_rest(goal) {
        let dt_s = sampler.uniform(0.05, 1.0) * most_dt_s;
        let next = at.towards(goal, &bounds, dt_s);
        let jerk = (next.qdd_rad_per_s2 - at.qdd_rad_per_s2) / dt_s;
        let shares = [
            next.qd_rad_per_s / LIMITS[0],
            next.qdd_rad_per_s2 / LIMITS[1],
            jerk / LIMITS[2],
        ];
        most = std::array::from_fn(|k| most[k].max(shares[k].abs()));
        (at, t_s) = (next, t_s + dt_s);
        assert!(t_s < 20.0, "never arrives: {start:?} {goal} {at:?}");
    }
    (t_s, most)
}

#[test]
fn limits_hold_and_the_goal_is_met_exactly_in_irregular_steps() {
    let mut sampler = Sampler::new(2);
    for _ in 0..500 {
        let start = random_state(&mut sampler);
        let goal = sampler.uniform(-1.5, 1.5);
        let (t_s, most) = run(start, goal, 2e-3, &mut sampler);
        assert!(
            most.iter().all(|m| *m <= 1.0 + 1e-6),
            "{start:?} {goal} {most:?}"
        );
        let once = start.towards(goal, &bounds(), t_s);
        assert!((once.q_rad - goal).abs() < 1e-9, "{once:?} {goal}");
    }
}

#[test]
fn from_rest_a_goal_is_never_passed() {
    let mut sampler = Sampler::new(3);
    for _ in 0..500 {
        let goal = sampler.uniform(-1.0, 1.0) * [1.0, 1e-2, 1e-6, 1e-12][sampler.index(4)];
        let mut at = JointPoint::at_rest(0.0);
        for _ in 0..5000 {
            at = at.towards(goal, &bounds(), sampler.uniform(1e-5, 2e-3));
            assert!((at.q_rad - goal) * goal.signum() <= 1e-15, "{at:?} {goal}");
            assert!(at.q_rad * goal.signum() >= -1e-16, "{at:?} {goal}");
        }
        assert_eq!(at, JointPoint::at_rest(goal));
    }
}

#[test]
fn goals_that_jump_every_step_keep_the_stopping_point_between_them() {
    let mut sampler = Sampler::new(4);
    let bounds = bounds();
    let mut at = JointPoint::at_rest(0.0);
    for _ in 0..100_000 {
        let goal = match sampler.index(3) {
            0 => -0.3,
            1 => 0.3,
            _ => sampler.uniform(-0.3, 0.3),
        };
        let (before, dt) = (at, sampler.uniform(1e-4, 0.02));
        at = at.towards(goal, &bounds, dt);
        assert!(at.stopping_point_rad(&bounds).abs() <= 0.3 + 1e-9, "{at:?}");
        assert!(at.q_rad.abs() <= 0.3 + 1e-9, "{at:?}");
        assert!(at.qd_rad_per_s.abs() <= LIMITS[0] * (1.0 + 1e-9));
        assert!(at.qdd_rad_per_s2.abs() <= LIMITS[1] * (1.0 + 1e-9));
        let jerk = (at.qdd_rad_per_s2 - before.qdd_rad_per_s2).abs() / dt;
        assert!(jerk <= LIMITS[2] * (1.0 + 1e-6), "{jerk}");
    }
}

#[test]
fn beyond_its_bounds_a_joint_comes_back_and_still_arrives() {
    let mut sampler = Sampler::new(5);
    for _ in 0..300 {
        let start = JointPoint::new(
            sampler.uniform(-1.0, 1.0),
            sampler.uniform(-3.0, 3.0) * LIMITS[0],
            sampler.uniform(-3.0, 3.0) * LIMITS[1],
        );
        let goal = sampler.uniform(-1.0, 1.0);
        let (_, most) = run(start, goal, 2e-3, &mut sampler);
        assert!(most[2] <= 1.0 + 1e-6, "{start:?} {most:?}");
    }
}

/// A goal in a frame that moves at the joint's own limit is never reached, and the joint does not jump to it.
#[test]
fn a_frame_that_leaves_no_speed_is_not_caught_up_with() {
    let none_left = bounds().beside(LIMITS[0], [0.0, 0.0]);
    let mut at = JointPoint::at_rest(-0.1);
    for _ in 0..1000 {
        at = at.towards(0.0, &none_left, 1e-3);
        assert_eq!(at, JointPoint::at_rest(-0.1));
    }
    // Nor to a goal that leaves no acceleration.
    let none_left = bounds().beside(0.0, [-LIMITS[1], LIMITS[1]]);
    for dt_s in [1e-3, 1.0] {
        let next = at.towards(0.0, &none_left, dt_s);
        assert!((-0.1..-0.1 + 1e-6).contains(&next.q_rad), "{next:?}");
    }
}

#[test]
fn the_least_time_is_when_it_arrives() {
    let mut sampler = Sampler::new(9);
    for _ in 0..2000 {
        let start = random_state(&mut sampler);
        let goal = sampler.uniform(-1.5, 1.5);
        let time_s = start.time_to_s(goal, &bounds());
        let rests_after =
            |dt_s: f64| start.towards(goal, &bounds(), dt_s) == JointPoint::at_rest(goal);
        assert!(rests_after(time_s * (1.0 + 1e-12) + 1e-12), "{start:?}");
        assert!(!rests_after(time_s * (1.0 - 1e-9) - 1e-9), "{start:?}");
        let stop_s = start.time_to_stop_s(&bounds());
        assert_eq!(start.braked(&bounds(), stop_s + 1e-12).qd_rad_per_s, 0.0);
    }
    let at = JointPoint::at_rest(0.3);
    assert_eq!(at.time_to_s(0.3, &bounds()), 0.0);
    assert_eq!(at.time_to_stop_s(&bounds()), 0.0);
    assert!(at.time_to_s(f64::NAN, &bounds()).is_nan());
}

#[test]
fn very_long_and_very_short_steps_and_nan() {
    let start = JointPoint::at_rest(0.0);
    for long_s in [1e300, f64::INFINITY] {
        let end = start.towards(3.0, &bounds(), long_s);
        assert_eq!(end, JointPoint::at_rest(3.0));
    }
    let short = start.towards(3.0, &bounds(), 1e-15);
    assert!(short.q_rad >= 0.0 && short.q_rad < 1e-30 && short.qdd_rad_per_s2 > 0.0);
    assert_eq!(start.towards(3.0, &bounds(), -1.0), start);
    assert!(start.towards(f64::NAN, &bounds(), 1.0).q_rad.is_nan());
    assert!(start.towards(1.0, &bounds(), f64::NAN).q_rad.is_nan());
    let nan = JointPoint {
        qdd_rad_per_s2: f64::NAN,
        ..start
    };
    assert!(nan.braked(&bounds(), 1e-3).q_rad.is_nan());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(JointBounds::new(bad, 1.0, 1.0).is_err());
        assert!(JointBounds::new(1.0, bad, 1.0).is_err());
        assert!(JointBounds::new(1.0, 1.0, bad).is_err());
    }
}
