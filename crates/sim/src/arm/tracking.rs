//! Tracking of the commanded motion by one joint.

use super::stream::Ahead;
use hwall_motion::{JointBounds, JointPoint};

/// A joint within this distance of its commanded position counts as being there, rad.
const THERE_RAD: f64 = 1e-10;
/// Between commands further apart than this the commanded motion is an estimate, s.
const EXACT_S: f64 = 1e-3;
/// Relative amount by which that estimate may exceed the acceleration limit, per second of period beyond `EXACT_S`.
const EXCESS_PER_S: f64 = 6.0;

/// One step of one joint.
#[derive(Debug)]
pub(super) struct Step {
    pub(super) dt_s: f64,
    /// Commanded state at its start and at its end.
    pub(super) start: JointPoint,
    pub(super) end: JointPoint,
    /// Time between the commands before and after the step, s.
    pub(super) period_s: f64,
    /// True if a joint within its limits can pass through the commands before and after the step.
    pub(super) is_feasible: bool,
    /// True if the step leads from one command to the next.
    pub(super) is_whole: bool,
}

/// Limits of one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tracking {
    pub(super) bounds: JointBounds,
    /// Smallest and largest angle, rad.
    range_rad: [f64; 2],
    /// Upper bound of the stopping distance, rad.
    stopping_rad: f64,
}

impl Tracking {
    pub(super) fn new(bounds: JointBounds, range_rad: [f64; 2]) -> Self {
        let v = bounds.velocity_rad_per_s();
        let a = bounds.acceleration_rad_per_s2();
        let rise_s = a / bounds.jerk_rad_per_s3();
        Self {
            bounds,
            range_rad,
            stopping_rad: v * (0.5 * v / a + 2.0 * rise_s),
        }
    }

    /// The joint at the end of the step if it can follow the command exactly, that is, if it was at the commanded state at the start
    /// and the step is within the limits.
    pub(super) fn followed(&self, joint: &JointPoint, step: &Step) -> Option<JointPoint> {
        let (v, a, j) = (
            self.bounds.velocity_rad_per_s(),
            self.bounds.acceleration_rad_per_s2(),
            self.bounds.jerk_rad_per_s3(),
        );
        let Step {
            dt_s, start, end, ..
        } = step;
        if (joint.q_rad - start.q_rad).abs() > THERE_RAD {
            return None;
        }
        let as_asked = if step.is_feasible && step.is_whole {
            // Only the commands must be reached, not the motion between them. Slopes are estimates whose error
            // shrinks with the square of the period.
            (joint.qd_rad_per_s - start.qd_rad_per_s).abs() <= j * dt_s * dt_s
        } else {
            let coasted = joint.jerked(0.0, *dt_s);
            let change = |now: f64, coasted: f64, of_jerk: f64, rounding: f64| {
                (now - coasted).abs() <= j * of_jerk + rounding
            };
            let (q, qd, qdd) = (coasted.q_rad, coasted.qd_rad_per_s, coasted.qdd_rad_per_s2);
            end.qd_rad_per_s.abs() <= v * (1.0 + 1e-9)
                && end.coming_velocity_rad_per_s(&self.bounds).abs() <= v * (1.0 + 1e-9)
                && end.qdd_rad_per_s2.abs() <= a * (1.0 + 1e-6)
                && change(end.q_rad, q, dt_s.powi(3) / 6.0, THERE_RAD)
                && change(end.qd_rad_per_s, qd, dt_s * dt_s / 2.0, 1e-9 * v)
                && change(end.qdd_rad_per_s2, qdd, *dt_s, 1e-6 * a)
        };
        if !as_asked {
            return None;
        }
        let mut next = JointPoint::new(
            end.q_rad,
            end.qd_rad_per_s.clamp(-v, v),
            end.qdd_rad_per_s2.clamp(-a, a),
        );
        let coming = next.coming_velocity_rad_per_s(&self.bounds);
        if coming.abs() > v {
            // The largest acceleration that the speed limit allows.
            let left = (2.0 * j * (v - next.qd_rad_per_s.abs())).sqrt();
            next.qdd_rad_per_s2 = left.copysign(coming);
        }
        // A stream that ends abruptly near a joint limit must not carry the joint beyond it.
        let [least, most] = self.range_rad;
        let is_far =
            next.q_rad - least > self.stopping_rad && most - next.q_rad > self.stopping_rad;
        let stops_within = || {
            let stop = next.stopping_point_rad(&self.bounds);
            (least - THERE_RAD..=most + THERE_RAD).contains(&stop)
        };
        (is_far || stops_within()).then_some(next)
    }

    /// True if the joint is as close to a feasible stream as the error of the estimate between its commands.
    fn is_beside(&self, joint: &JointPoint, step: &Step) -> bool {
        let (j, h) = (self.bounds.jerk_rad_per_s3(), step.period_s);
        let off_rad = (joint.q_rad - step.start.q_rad).abs();
        let off_rad_per_s = (joint.qd_rad_per_s - step.start.qd_rad_per_s).abs();
        step.is_feasible && off_rad <= 0.5 * j * h * h * h && off_rad_per_s <= 0.5 * j * h * h
    }

    /// The joint at the end of the step on its time-optimal trajectory to the commanded motion, extrapolated from the end of the step.
    ///
    /// The joint's stopping point never passes the point where the commanded motion would come to rest, so the
    /// joint does not overshoot if the commands brake meanwhile.
    pub(super) fn caught_up(&self, joint: &JointPoint, step: &Step, ahead: &Ahead) -> JointPoint {
        let is_beside = self.is_beside(joint, step);
        // The estimate may exceed the acceleration limit. Allow the joint the same excess: otherwise it would lag
        // without need, and at full acceleration it could not catch up.
        let excess = EXCESS_PER_S * (step.period_s - EXACT_S);
        let bounds = &match is_beside {
            true => self.bounds.with_more_acceleration(excess),
            false => self.bounds,
        };
        let (dt_s, asked) = (step.dt_s, &step.end);
        let (v_max, a_max) = (
            bounds.velocity_rad_per_s(),
            bounds.acceleration_rad_per_s2(),
        );
        let v = asked.qd_rad_per_s.clamp(-v_max, v_max);
        let qdd = if step.is_feasible {
            asked.qdd_rad_per_s2
        } else {
            ahead.qdd_rad_per_s2
        };
        let a = qdd.clamp(-a_max, a_max);
        // Relative to a frame that moves like the command at the end of the step.
        let relative = JointPoint::new(
            joint.q_rad - (asked.q_rad - dt_s * (v - 0.5 * a * dt_s)),
            joint.qd_rad_per_s - (v - a * dt_s),
            joint.qdd_rad_per_s2 - a,
        );
        let [least, most] = ahead.range_rad_per_s2;
        let braking = bounds.beside(v, [least.min(a), most.max(a)]);
        let relative = relative.towards_braking(0.0, &bounds.beside(v, [a, a]), &braking, dt_s);
        let met = relative == JointPoint::at_rest(0.0);
        let mut next = JointPoint::new(
            asked.q_rad + relative.q_rad,
            v + relative.qd_rad_per_s,
            a + relative.qdd_rad_per_s2,
        );
        let coming = next.coming_velocity_rad_per_s(bounds);
        let fastest = if coming.abs() > next.qd_rad_per_s.abs() {
            coming
        } else {
            next.qd_rad_per_s
        };
        if fastest.abs() > v_max {
            next = joint.at_speed(v_max.copysign(fastest), bounds, dt_s);
        }
        if !met && !is_beside {
            let asked = JointPoint::new(asked.q_rad, v, a);
            next = self.before_rest(joint, step, &asked, ahead.rest_rad, next);
        }
        let stop = next.stopping_point_rad(bounds);
        let [least, most] = self.range_rad;
        if stop < least || stop > most {
            next = joint.towards(stop.clamp(least, most), bounds, dt_s);
        }
        self.within_range(next)
    }

    /// Prevents the stopping point of a joint from passing the point where the commanded motion would come to rest, or
    /// its current position if it moves towards the joint.
    fn before_rest(
        &self,
        joint: &JointPoint,
        step: &Step,
        asked: &JointPoint,
        rest_rad: f64,
        next: JointPoint,
    ) -> JointPoint {
        let rest = rest_rad.clamp(self.range_rad[0], self.range_rad[1]);
        let sign = if joint.q_rad <= step.start.q_rad {
            1.0
        } else {
            -1.0
        };
        let before = joint.stopping_point_rad(&self.bounds);
        let after = next.stopping_point_rad(&self.bounds);
        let mut most = (sign * rest).max(sign * asked.stopping_point_rad(&self.bounds));
        if sign * (rest - before) < 0.0 {
            most = most.max(sign * asked.q_rad);
        }
        let most = sign * most;
        if sign * (after - most) > 0.0 && sign * (after - before) > 0.0 {
            joint.towards(most, &self.bounds, step.dt_s)
        } else {
            next
        }
    }

    pub(super) fn braked(&self, joint: &JointPoint, dt_s: f64) -> JointPoint {
        self.within_range(joint.braked(&self.bounds, dt_s))
    }

    /// Removes rounding beyond the range and the speed limit.
    pub(super) fn within_range(&self, mut joint: JointPoint) -> JointPoint {
        let v = self.bounds.velocity_rad_per_s();
        joint.q_rad = joint.q_rad.clamp(self.range_rad[0], self.range_rad[1]);
        joint.qd_rad_per_s = joint.qd_rad_per_s.clamp(-v, v);
        joint
    }
}
