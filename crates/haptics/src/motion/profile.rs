//! Time-optimal motion of one joint under velocity and acceleration limits.

/// Limits of the motion of one joint, the same in both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JointBounds {
    pub(super) velocity_rad_per_s: f64,
    pub(super) acceleration_rad_per_s2: f64,
}

/// Speed reserved for catching up with a goal that itself moves at the limit, rad/s.
const LEAST_SPARE_RAD_PER_S: f64 = 1e-6;

/// Position and velocity of one joint that moves to a goal which may change at any time.
///
/// If any input is NaN, both are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JointMotion {
    /// Angle, rad.
    pub(super) q_rad: f64,
    /// Velocity, rad/s.
    pub(super) qd_rad_per_s: f64,
}

impl JointMotion {
    /// Where the joint comes to rest under full braking, rad: `q + v |v| / 2a`.
    pub(super) fn stopping_point_rad(self, bounds: &JointBounds) -> f64 {
        self.q_rad
            + self.qd_rad_per_s * self.qd_rad_per_s.abs() / (2.0 * bounds.acceleration_rad_per_s2)
    }

    /// The motion `dt_s` later, time-optimal to rest at `goal_rad`.
    ///
    /// Accelerate, cruise, brake, in closed form, so the result does not depend on how time is divided into steps. The goal is reached exactly. The
    /// stopping point only moves towards the goal: there is no overshoot of a goal at rest, unless it jumped too near to stop before it, and the
    /// joint never passes the outermost place of a moving goal. A joint above its velocity limit first brakes down to it.
    ///
    /// A step of zero or less changes nothing. Error: about 1e-16 of the angles; 1e-8 rad/s in the last moment before rest, where the speed is the
    /// root of a distance.
    pub(super) fn towards(self, goal_rad: f64, bounds: &JointBounds, dt_s: f64) -> Self {
        if dt_s <= 0.0 {
            return self;
        }
        let a = bounds.acceleration_rad_per_s2;
        // Sign such that the stopping point lies before the goal.
        let sign = if self.stopping_point_rad(bounds) <= goal_rad {
            1.0
        } else {
            -1.0
        };
        let (d, v) = (sign * (goal_rad - self.q_rad), sign * self.qd_rad_per_s);
        if d.is_nan() || v.is_nan() || dt_s.is_nan() {
            // The minima and maxima below would drop NaN.
            return Self {
                q_rad: f64::NAN,
                qd_rad_per_s: f64::NAN,
            };
        }
        let peak = (0.5 * v * v + a * d)
            .max(0.0)
            .sqrt()
            .max(v)
            .min(bounds.velocity_rad_per_s);
        let t_change = (peak - v).abs() / a;
        let t_brake = peak / a;
        let cruise = d - 0.5 * (v + peak) * t_change - 0.5 * peak * t_brake;
        let t_cruise = if peak > 0.0 {
            (cruise / peak).max(0.0)
        } else {
            0.0
        };
        let left = t_change + t_cruise + t_brake - dt_s;
        if left <= 0.0 {
            return Self {
                q_rad: goal_rad,
                qd_rad_per_s: 0.0,
            };
        }
        let (moved, speed) = if dt_s < t_change {
            let change = (peak - v).signum() * a * dt_s;
            (dt_s * (v + 0.5 * change), v + change)
        } else if left > t_brake {
            (0.5 * t_change * (v + peak) + (dt_s - t_change) * peak, peak)
        } else {
            // Counted back from the end, so that the goal is reached exactly.
            (d - 0.5 * a * left * left, (a * left).min(peak))
        };
        Self {
            q_rad: self.q_rad + sign * moved,
            qd_rad_per_s: sign * speed,
        }
    }

    /// The motion `dt_s` later, time-optimal to a goal that is then at `goal_rad` and moves at a given velocity. The speed that the goal leaves below
    /// the limit serves to catch up.
    ///
    /// Once reached, a goal whose acceleration stays within the bounds is followed without lag.
    pub(super) fn beside(
        self,
        goal_rad: f64,
        goal_rad_per_s: f64,
        bounds: &JointBounds,
        dt_s: f64,
    ) -> Self {
        let spare = JointBounds {
            velocity_rad_per_s: (bounds.velocity_rad_per_s - goal_rad_per_s.abs())
                .max(LEAST_SPARE_RAD_PER_S),
            ..*bounds
        };
        let relative = Self {
            q_rad: self.q_rad - (goal_rad - goal_rad_per_s * dt_s),
            qd_rad_per_s: self.qd_rad_per_s - goal_rad_per_s,
        };
        let next = relative.towards(0.0, &spare, dt_s);
        let most = bounds.velocity_rad_per_s;
        Self {
            q_rad: goal_rad + next.q_rad,
            qd_rad_per_s: (goal_rad_per_s + next.qd_rad_per_s).clamp(-most, most),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;
    use proptest::prelude::*;

    const BOUNDS: JointBounds = JointBounds {
        velocity_rad_per_s: 1.5,
        acceleration_rad_per_s2: 10.0,
    };

    const fn moving(q_rad: f64, qd_rad_per_s: f64) -> JointMotion {
        JointMotion {
            q_rad,
            qd_rad_per_s,
        }
    }

    const fn at_rest(q_rad: f64) -> JointMotion {
        moving(q_rad, 0.0)
    }

    #[test]
    fn the_way_does_not_depend_on_the_steps() {
        let mut s = Sampler::new(12);
        for _ in 0..2000 {
            let start = moving(s.uniform(-2.0, 2.0), s.uniform(-1.5, 1.5));
            let (goal, dt) = (s.uniform(-2.0, 2.0), s.uniform(0.0, 2.0));
            let once = start.towards(goal, &BOUNDS, dt);
            let mut many = start;
            for _ in 0..64 {
                many = many.towards(goal, &BOUNDS, dt / 64.0);
            }
            assert!((once.q_rad - many.q_rad).abs() < 1e-13, "{once:?} {many:?}");
            // Near rest the speed is the root of a distance known to 1e-16.
            let off = (once.qd_rad_per_s - many.qd_rad_per_s).abs();
            assert!(off < 1e-6, "{once:?} {many:?}");
        }
    }

    #[test]
    fn goals_that_jump_every_step_are_never_passed_at_the_outside() {
        let mut s = Sampler::new(13);
        let mut motion = at_rest(0.0);
        for _ in 0..100_000 {
            let goal = match s.bool() {
                true => s.uniform(-0.3, 0.3),
                false => [-0.3, 0.3][s.index(2)],
            };
            let (before, dt) = (motion, s.uniform(1e-4, 0.02));
            motion = motion.towards(goal, &BOUNDS, dt);
            assert!(motion.q_rad.abs() <= 0.3 + 1e-15);
            assert!(motion.qd_rad_per_s.abs() <= BOUNDS.velocity_rad_per_s + 1e-12);
            let change = (motion.qd_rad_per_s - before.qd_rad_per_s).abs();
            assert!(change <= BOUNDS.acceleration_rad_per_s2 * dt + 1e-9);
            assert!((motion.q_rad - before.q_rad).abs() <= BOUNDS.velocity_rad_per_s * dt + 1e-12);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The invariant behind every limit: the stopping point moves only towards the goal, never past it and never away from it.
        #[test]
        fn the_stopping_point_never_leaves_the_way_to_the_goal(
            q_rad in -3.0..3.0, qd_rad_per_s in -2.0..2.0, goal in -3.0..3.0,
            acceleration in 0.1..100.0, dt in (-20.0..0.0).prop_map(f64::exp),
        ) {
            let bounds = JointBounds { velocity_rad_per_s: 2.0, acceleration_rad_per_s2: acceleration };
            let before = moving(q_rad, qd_rad_per_s);
            let after = before.towards(goal, &bounds, dt);
            let stop = before.stopping_point_rad(&bounds);
            let (lo, hi) = (stop.min(goal), stop.max(goal));
            let slack = 1e-12 + 2e-9 * (hi - lo);
            let stop = after.stopping_point_rad(&bounds);
            prop_assert!((lo - slack..=hi + slack).contains(&stop), "{before:?} {after:?}");
            prop_assert!(after.qd_rad_per_s.abs() <= 2.0);
            let change = (after.qd_rad_per_s - qd_rad_per_s).abs();
            prop_assert!(change <= acceleration * dt * (1.0 + 1e-8) + 1e-15, "{before:?} {after:?}");
        }
    }

    /// Moves to the goal in irregular steps and checks that it overshoots only by the braking distance; returns the time of arrival.
    fn run(mut joint: JointMotion, goal: f64, bounds: &JointBounds) -> f64 {
        let ahead = (goal - joint.q_rad).signum();
        let brakes = (joint.stopping_point_rad(bounds) - goal) * ahead;
        let furthest = if brakes > 0.0 { brakes + 1e-11 } else { 1e-14 };
        let (mut t, mut i) = (0.0, 0);
        while joint != at_rest(goal) {
            let dt = [1e-3, 3e-4, 1e-9, 7e-4, 9e-6][i % 5];
            let next = joint.towards(goal, bounds, dt);
            let change = (next.qd_rad_per_s - joint.qd_rad_per_s).abs();
            let most = bounds.acceleration_rad_per_s2 * dt * (1.0 + 1e-8) + 1e-15;
            assert!(change <= most, "{joint:?} {next:?} {dt}");
            assert!(next.qd_rad_per_s.abs() <= bounds.velocity_rad_per_s);
            let over = (next.q_rad - goal) * ahead;
            assert!(over <= furthest, "overshot by {over}");
            (joint, t, i) = (next, t + dt, i + 1);
            assert!(i < 1_000_000, "never arrives: {joint:?}");
        }
        t
    }

    #[test]
    fn arrives_exactly_in_the_shortest_time_with_irregular_steps() {
        for (distance, velocity, acceleration) in [
            (1.0, 1.5, 10.0),
            (0.01, 1.5, 10.0),
            (1e-7, 1.5, 10.0),
            (3.0, 0.2, 50.0),
            (1e-14, 2.0, 10.0),
        ] {
            for sign in [-1.0, 1.0] {
                let bounds = JointBounds {
                    velocity_rad_per_s: velocity,
                    acceleration_rad_per_s2: acceleration,
                };
                let t = run(at_rest(0.3), 0.3 + sign * distance, &bounds);
                // Bang-bang, with a cruise where the peak would exceed the limit.
                let best = if distance * acceleration <= velocity * velocity {
                    2.0 * f64::sqrt(distance / acceleration)
                } else {
                    distance / velocity + velocity / acceleration
                };
                assert!(t <= best + 4e-3, "{distance} rad: {t} s, best {best} s");
            }
        }
    }

    #[test]
    fn brakes_and_returns_whatever_the_speed_at_first() {
        let mut s = Sampler::new(11);
        for _ in 0..200 {
            let start = moving(s.uniform(-2.0, 2.0), s.uniform(-1.5, 1.5));
            run(start, s.uniform(-2.0, 2.0), &BOUNDS);
        }
    }

    #[test]
    fn above_the_velocity_limit_it_brakes_down_to_it() {
        for sign in [-1.0, 1.0] {
            let after = |dt_s: f64| moving(0.0, 3.0 * sign).towards(100.0 * sign, &BOUNDS, dt_s);
            let next = after(0.01);
            assert!((next.qd_rad_per_s - 2.9 * sign).abs() < 1e-15);
            assert!((next.q_rad - 0.0295 * sign).abs() < 1e-15);
            assert_eq!(after(1.0).qd_rad_per_s, 1.5 * sign);
        }
    }

    #[test]
    fn nan_comes_out_where_nan_goes_in_and_no_step_changes_nothing() {
        let (joint, nan) = (moving(0.1, -0.4), f64::NAN);
        assert_eq!(joint.towards(1.0, &BOUNDS, 0.0), joint);
        assert_eq!(joint.towards(1.0, &BOUNDS, -1.0), joint);
        for (joint, goal, dt_s) in [
            (joint, nan, 1e-3),
            (joint, 1.0, nan),
            (moving(nan, -0.4), 1.0, 1e-3),
            (moving(0.1, nan), 1.0, 1e-3),
        ] {
            let next = joint.towards(goal, &BOUNDS, dt_s);
            assert!(next.q_rad.is_nan(), "{next:?}");
            assert!(next.qd_rad_per_s.is_nan(), "{next:?}");
        }
    }
}
