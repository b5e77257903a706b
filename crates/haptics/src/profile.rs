//! Motion of one joint towards a goal that may change at any time.

/// Position and velocity of a commanded joint, rad and rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointMotion {
    pub(crate) q: f64,
    pub(crate) qd: f64,
}

/// Bounds of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointBounds {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

impl JointMotion {
    /// Where full braking would come to rest.
    pub(crate) fn stop(&self, bounds: JointBounds) -> f64 {
        self.q + self.qd * self.qd.abs() / (2.0 * bounds.acceleration)
    }

    /// The motion `dt` later on the time-optimal way to rest at `goal`.
    ///
    /// Accelerate, cruise, brake, in closed form and not per step, so the result does not depend
    /// on how time is cut into steps. The point of rest of full braking only ever moves towards
    /// the goal: no overshoot for a goal that rests, and never past the outermost goal for one
    /// that moves.
    pub(crate) fn towards(self, goal: f64, bounds: JointBounds, dt: f64) -> Self {
        let a = bounds.acceleration;
        // In units where the first acceleration is positive.
        let sign = if self.stop(bounds) <= goal { 1.0 } else { -1.0 };
        let (d, v) = (sign * (goal - self.q), sign * self.qd);
        let peak = (0.5 * v * v + a * d).max(0.0).sqrt().min(bounds.velocity).max(v);
        let t_accelerate = (peak - v) / a;
        let t_brake = peak / a;
        let cruise = d - (peak * peak - 0.5 * v * v) / a;
        let t_cruise = if peak > 0.0 { (cruise / peak).max(0.0) } else { 0.0 };
        let left = t_accelerate + t_cruise + t_brake - dt;
        if left <= 0.0 {
            return Self { q: goal, qd: 0.0 };
        }
        let (moved, speed) = if dt < t_accelerate {
            (dt * (v + 0.5 * a * dt), v + a * dt)
        } else if left > t_brake {
            (0.5 * t_accelerate * (v + peak) + (dt - t_accelerate) * peak, peak)
        } else {
            (d - 0.5 * a * left * left, a * left)
        };
        Self { q: self.q + sign * moved, qd: sign * speed }
    }

    /// The motion `dt` later when braking at full deceleration.
    pub(crate) fn braked(self, bounds: JointBounds, dt: f64) -> Self {
        self.towards(self.stop(bounds), bounds, dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    const BOUNDS: JointBounds = JointBounds { velocity: 1.5, acceleration: 10.0 };

    #[test]
    fn a_resting_goal_is_met_exactly_without_overshoot() {
        let mut s = Sampler::new(11);
        for _ in 0..2000 {
            let start = JointMotion { q: s.uniform(-2.0, 2.0), qd: 0.0 };
            let goal = s.uniform(-2.0, 2.0);
            let (lo, hi) = (start.q.min(goal), start.q.max(goal));
            let mut motion = start;
            for _ in 0..5000 {
                motion = motion.towards(goal, BOUNDS, s.uniform(0.0, 0.01));
                assert!((lo - 1e-15..=hi + 1e-15).contains(&motion.q), "{motion:?} to {goal}");
            }
            assert_eq!(motion, JointMotion { q: goal, qd: 0.0 });
        }
    }

    #[test]
    fn the_way_does_not_depend_on_the_steps() {
        let mut s = Sampler::new(12);
        for _ in 0..2000 {
            let start = JointMotion { q: s.uniform(-2.0, 2.0), qd: s.uniform(-1.5, 1.5) };
            let (goal, dt) = (s.uniform(-2.0, 2.0), s.uniform(0.0, 2.0));
            let once = start.towards(goal, BOUNDS, dt);
            let mut many = start;
            for _ in 0..64 {
                many = many.towards(goal, BOUNDS, dt / 64.0);
            }
            assert!((once.q - many.q).abs() < 1e-13, "{once:?} {many:?}");
            // Near rest the speed is the root of a distance known to 1e-16.
            assert!((once.qd - many.qd).abs() < 1e-6, "{once:?} {many:?}");
        }
    }

    #[test]
    fn goals_that_jump_every_step_are_never_passed_at_the_outside() {
        let mut s = Sampler::new(13);
        let mut motion = JointMotion { q: 0.0, qd: 0.0 };
        for _ in 0..100_000 {
            let goal = if s.bool() { s.uniform(-0.3, 0.3) } else { [-0.3, 0.3][s.index(2)] };
            let (before, dt) = (motion, s.uniform(1e-4, 0.02));
            motion = motion.towards(goal, BOUNDS, dt);
            assert!(motion.q.abs() <= 0.3 + 1e-15);
            assert!(motion.qd.abs() <= BOUNDS.velocity + 1e-12);
            assert!((motion.qd - before.qd).abs() <= BOUNDS.acceleration * dt + 1e-9);
            assert!((motion.q - before.q).abs() <= BOUNDS.velocity * dt + 1e-12);
        }
    }

    #[test]
    fn braking_takes_the_stopping_distance() {
        for qd in [-1.5, -0.2, 0.0, 0.7, 1.5] {
            let mut motion = JointMotion { q: 0.4, qd };
            let rest = motion.stop(BOUNDS);
            for _ in 0..200 {
                motion = motion.braked(BOUNDS, 1e-3);
            }
            assert!((motion.q - rest).abs() < 1e-15 && motion.qd == 0.0, "{motion:?}");
        }
    }
}
