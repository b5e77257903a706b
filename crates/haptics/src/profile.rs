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
