//! Motion of one joint under velocity and acceleration limits.

/// Slack of the stopping condition: a joint that brakes along its profile for many steps meets
/// it only to a few roundings, each about 1e-16 of the distance.
const ROUNDING: f64 = 1e-9;

/// Position and velocity of one joint; the unit is whatever the limits are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointMotion {
    pub(crate) q: f64,
    pub(crate) v: f64,
}

impl JointMotion {
    /// State after `h` s on the way to `target`, as fast as the limits allow.
    ///
    /// The acceleration is constant within a step, except that a joint may come to rest before
    /// the step ends. The new velocity is the largest one from which full braking still stops at
    /// the target: `(v + v') h / 2 + v'² / 2a <= d`. That condition is about the continuous
    /// motion and so does not depend on `h`: steps may be irregular, and a target at rest is
    /// never overshot. If the target jumped so near that the joint cannot stop before it, the
    /// joint brakes fully and comes back.
    pub(crate) fn towards(self, target: f64, v_max: f64, a_max: f64, h: f64) -> Self {
        // Mirrored so that the target lies ahead, at the distance d.
        let sign = if target < self.q { -1.0 } else { 1.0 };
        let (d, v) = ((target - self.q) * sign, self.v * sign);
        let can_stop = v <= 0.0 || v * v <= 2.0 * a_max * d * (1.0 + ROUNDING);
        if !can_stop {
            return self.braking(a_max, h);
        }
        let reserve = d - 0.5 * v * h;
        if reserve <= 0.0 {
            // Arrives within this step, at rest, with an acceleration v² / 2d <= a.
            return Self { q: target, v: 0.0 };
        }
        // Root of the condition above, in the form without cancellation.
        let x = 2.0 * reserve / a_max;
        let profile = a_max * x / ((0.25 * h * h + x).sqrt() + 0.5 * h);
        let v_new = profile.min(v_max).clamp(v - a_max * h, v + a_max * h);
        Self { q: self.q + sign * 0.5 * (v + v_new) * h, v: sign * v_new }
    }

    /// State after `h` s of full braking; at rest it stays.
    pub(crate) fn braking(self, a_max: f64, h: f64) -> Self {
        let speed = self.v.abs();
        let dv = a_max * h;
        if speed <= dv {
            let stop = 0.5 * self.v * speed / a_max;
            return Self { q: self.q + stop, v: 0.0 };
        }
        let v_new = self.v - dv.copysign(self.v);
        Self { q: self.q + 0.5 * (self.v + v_new) * h, v: v_new }
    }
}

#[cfg(test)]
mod tests {
    use super::JointMotion;
    use proptest::prelude::*;

    proptest! {
        /// The invariant behind every limit: where the joint would come to rest moves only
        /// towards the target, never past it and never away from it.
        #[test]
        fn the_stopping_point_never_leaves_the_way_to_the_target(
            q in -3.0..3.0, v in -2.0..2.0, target in -3.0..3.0,
            a_max in 0.1..100.0, h in (-20.0..0.0).prop_map(f64::exp),
        ) {
            let stop = |joint: JointMotion| joint.q + 0.5 * joint.v * joint.v.abs() / a_max;
            let before = JointMotion { q, v };
            let after = before.towards(target, 2.0, a_max, h);
            let (lo, hi) = (stop(before).min(target), stop(before).max(target));
            let slack = 1e-12 + 2e-9 * (hi - lo);
            prop_assert!((lo - slack..=hi + slack).contains(&stop(after)), "{} {}", stop(before), stop(after));
            prop_assert!(after.v.abs() <= 2.0);
            prop_assert!((after.v - v).abs() <= a_max * h * (1.0 + 1e-8) + 1e-15);
        }
    }

    /// Steps to the target with irregular steps; returns the time at rest there.
    fn run(mut joint: JointMotion, target: f64, v_max: f64, a_max: f64) -> f64 {
        let ahead = (target - joint.q).signum();
        let (mut t, mut i) = (0.0, 0);
        while joint.q != target || joint.v != 0.0 {
            let h = [1e-3, 3e-4, 1e-9, 7e-4, 9e-6][i % 5];
            let next = joint.towards(target, v_max, a_max, h);
            assert!((next.v - joint.v).abs() <= a_max * h * (1.0 + 1e-8) + 1e-15);
            assert!(next.v.abs() <= v_max);
            assert!((next.q - target) * ahead <= 1e-14, "overshot by {}", (next.q - target) * ahead);
            (joint, t, i) = (next, t + h, i + 1);
            assert!(i < 1_000_000, "never arrives: {joint:?}");
        }
        t
    }

    #[test]
    fn arrives_exactly_in_the_shortest_time_and_never_overshoots() {
        for (distance, v_max, a_max) in
            [(1.0, 1.5, 10.0), (0.01, 1.5, 10.0), (1e-7, 1.5, 10.0), (3.0, 0.2, 50.0), (1e-14, 2.0, 10.0)]
        {
            for sign in [-1.0, 1.0] {
                let target = 0.3 + sign * distance;
                let t = run(JointMotion { q: 0.3, v: 0.0 }, target, v_max, a_max);
                // Bang-bang, with a cruise where the peak would pass the limit.
                let best = if distance * a_max <= v_max * v_max {
                    2.0 * f64::sqrt(distance / a_max)
                } else {
                    distance / v_max + v_max / a_max
                };
                assert!(t <= best + 4e-3, "{distance} m: {t} s, best {best} s");
            }
        }
    }

    #[test]
    fn brakes_and_returns_when_the_target_jumps_too_near() {
        let mut joint = JointMotion { q: 0.0, v: 1.0 };
        let mut furthest: f64 = 0.0;
        for _ in 0..2000 {
            joint = joint.towards(0.01, 1.5, 10.0, 1e-3);
            furthest = furthest.max(joint.q);
        }
        assert_eq!(joint, JointMotion { q: 0.01, v: 0.0 });
        // The stopping distance v² / 2a, and no more.
        assert!((furthest - 0.05).abs() < 1e-12, "{furthest}");
    }

    #[test]
    fn turns_round_when_moving_away() {
        let mut joint = JointMotion { q: 0.0, v: -1.0 };
        let mut lowest: f64 = 0.0;
        for _ in 0..2000 {
            joint = joint.towards(0.2, 1.5, 10.0, 1e-3);
            lowest = lowest.min(joint.q);
        }
        assert_eq!(joint, JointMotion { q: 0.2, v: 0.0 });
        assert!(lowest >= -0.05 - 1e-6);
    }
}
