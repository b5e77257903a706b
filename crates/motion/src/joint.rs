//! Jerk-limited, time-optimal motion of a single joint, in closed form except for one root.

use crate::error::MotionError;
use hwall_numeric::check::within;

/// Angle, velocity and acceleration of one joint.
///
/// NaN in any of them makes every result NaN.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointPoint {
    /// Angle, rad.
    pub q_rad: f64,
    /// Velocity, rad/s.
    pub qd_rad_per_s: f64,
    /// Acceleration, rad/s².
    pub qdd_rad_per_s2: f64,
}

/// Ranges of speed and acceleration of one joint, and its largest jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// Smallest and largest velocity, rad/s.
    velocity: [f64; 2],
    /// Smallest and largest acceleration, rad/s².
    acceleration: [f64; 2],
    jerk: f64,
}

/// Least acceleration that remains for a joint in a moving frame, as a share of its full range.
const LEAST_SHARE: f64 = 1e-9;

impl JointBounds {
    /// Largest speed, rad/s, acceleration, rad/s², and jerk, rad/s³, the same in both directions.
    ///
    /// # Errors
    /// A bound outside 1e-9 to 1e12.
    pub fn new(
        velocity_rad_per_s: f64,
        acceleration_rad_per_s2: f64,
        jerk_rad_per_s3: f64,
    ) -> Result<Self, MotionError> {
        for (what, value) in [
            ("velocity_rad_per_s", velocity_rad_per_s),
            ("acceleration_rad_per_s2", acceleration_rad_per_s2),
            ("jerk_rad_per_s3", jerk_rad_per_s3),
        ] {
            within(what, value, 1e-9..=1e12, "between 1e-9 and 1e12")?;
        }
        Ok(Self {
            velocity: [-velocity_rad_per_s, velocity_rad_per_s],
            acceleration: [-acceleration_rad_per_s2, acceleration_rad_per_s2],
            jerk: jerk_rad_per_s3,
        })
    }

    /// Largest velocity, rad/s.
    #[must_use]
    pub const fn velocity_rad_per_s(&self) -> f64 {
        self.velocity[1]
    }

    /// Largest acceleration, rad/s².
    #[must_use]
    pub const fn acceleration_rad_per_s2(&self) -> f64 {
        self.acceleration[1]
    }

    /// Largest jerk, rad/s³.
    #[must_use]
    pub const fn jerk_rad_per_s3(&self) -> f64 {
        self.jerk
    }

    /// These bounds with the speed multiplied by a share.
    pub(crate) fn at_share(mut self, share: f64) -> Self {
        self.velocity = self.velocity.map(|v| v * share);
        self
    }

    /// These bounds with the acceleration increased in both directions by a share of itself; negative shares count as 0.
    #[must_use]
    pub fn with_more_acceleration(mut self, share: f64) -> Self {
        self.acceleration = self.acceleration.map(|a| a * (1.0 + share.max(0.0)));
        self
    }

    /// The bounds that remain for motion relative to a frame that has this velocity and an acceleration between these two values. A minimal
    /// acceleration always remains.
    #[must_use]
    pub fn beside(&self, velocity_rad_per_s: f64, acceleration_rad_per_s2: [f64; 2]) -> Self {
        let [lo, hi] = self.acceleration;
        let least = LEAST_SHARE * (hi - lo);
        Self {
            velocity: [
                (self.velocity[0] - velocity_rad_per_s).min(0.0),
                (self.velocity[1] - velocity_rad_per_s).max(0.0),
            ],
            acceleration: [
                (lo - acceleration_rad_per_s2[0]).min(-least),
                (hi - acceleration_rad_per_s2[1]).max(least),
            ],
            jerk: self.jerk,
        }
    }
}

/// An interval of constant jerk.
#[derive(Debug, Clone, Copy, Default)]
struct Stretch {
    time_s: f64,
    jerk: f64,
}

/// The quickest transition to a velocity with zero acceleration: jerk, constant acceleration, jerk.
#[derive(Debug, Clone, Copy)]
struct SpeedChange {
    stretches: [Stretch; 3],
    end_rad_per_s: f64,
}

impl SpeedChange {
    fn new(from: &JointPoint, end_rad_per_s: f64, bounds: &JointBounds) -> Self {
        let jerk = bounds.jerk;
        let (v, a) = (from.qd_rad_per_s, from.qdd_rad_per_s2);
        // The velocity after an immediate return to zero acceleration gives the direction of the jerk.
        let up = v + 0.5 * a * a.abs() / jerk <= end_rad_per_s;
        let (sign, most) = if up {
            (1.0, bounds.acceleration[1])
        } else {
            (-1.0, -bounds.acceleration[0])
        };
        let (a, change) = (sign * a, sign * (end_rad_per_s - v));
        let free_peak = (jerk * change + 0.5 * a * a).max(0.0).sqrt();
        let peak = free_peak.min(most);
        let rise = Stretch {
            time_s: (peak - a).abs() / jerk,
            jerk: sign * jerk.copysign(peak - a),
        };
        let fall = Stretch {
            time_s: peak / jerk,
            jerk: -sign * jerk,
        };
        let left = change - 0.5 * (a + peak) * rise.time_s - 0.5 * peak * fall.time_s;
        let hold = Stretch {
            time_s: if free_peak > most {
                (left / peak).max(0.0)
            } else {
                0.0
            },
            jerk: 0.0,
        };
        Self {
            stretches: [rise, hold, fall],
            end_rad_per_s,
        }
    }

    fn time_s(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.time_s).sum()
    }

    /// The state at its end.
    fn end(&self, from: &JointPoint) -> JointPoint {
        let mut at = *from;
        for stretch in &self.stretches {
            at = at.jerked(stretch.jerk, stretch.time_s);
        }
        JointPoint::new(at.q_rad, self.end_rad_per_s, 0.0)
    }

    fn after(&self, from: &JointPoint, time_s: f64) -> JointPoint {
        let (mut at, mut left_s) = (*from, time_s);
        for stretch in &self.stretches {
            if left_s < stretch.time_s {
                return at.jerked(stretch.jerk, left_s);
            }
            at = at.jerked(stretch.jerk, stretch.time_s);
            left_s -= stretch.time_s;
        }
        JointPoint::new(
            at.q_rad + self.end_rad_per_s * left_s,
            self.end_rad_per_s,
            0.0,
        )
    }
}

impl JointPoint {
    /// A position, rad, with its velocity, rad/s, and acceleration, rad/s².
    #[must_use]
    pub const fn new(q_rad: f64, qd_rad_per_s: f64, qdd_rad_per_s2: f64) -> Self {
        Self {
            q_rad,
            qd_rad_per_s,
            qdd_rad_per_s2,
        }
    }

    /// Standing still.
    #[must_use]
    pub const fn at_rest(q_rad: f64) -> Self {
        Self {
            q_rad,
            qd_rad_per_s: 0.0,
            qdd_rad_per_s2: 0.0,
        }
    }

    /// This state under a time scale `time_scale` that changes at a rate, 1/s.
    pub(crate) fn at_time_scale(self, time_scale: f64, rate_per_s: f64) -> Self {
        let acceleration =
            time_scale * time_scale * self.qdd_rad_per_s2 + rate_per_s * self.qd_rad_per_s;
        Self {
            qd_rad_per_s: time_scale * self.qd_rad_per_s,
            qdd_rad_per_s2: acceleration,
            ..self
        }
    }

    fn is_nan(&self) -> bool {
        (self.q_rad + self.qd_rad_per_s + self.qdd_rad_per_s2).is_nan()
    }

    fn nan() -> Self {
        Self::new(f64::NAN, f64::NAN, f64::NAN)
    }

    /// The state after constant jerk for a time.
    #[must_use]
    pub fn jerked(&self, jerk_rad_per_s3: f64, time_s: f64) -> Self {
        let (v, a, j, t) = (
            self.qd_rad_per_s,
            self.qdd_rad_per_s2,
            jerk_rad_per_s3,
            time_s,
        );
        Self::new(
            self.q_rad + t * (v + t * (0.5 * a + t * j / 6.0)),
            v + t * (a + 0.5 * t * j),
            a + t * j,
        )
    }

    /// Where the joint comes to rest under full braking, rad.
    ///
    /// Error: about 1e-16 of the angles. Source: the braking profile of [Berscheid and Kröger 2021] and
    /// [Biagiotti and Melchiorri 2008], section 3.4, from any velocity and acceleration.
    #[must_use]
    pub fn stopping_point_rad(&self, bounds: &JointBounds) -> f64 {
        if self.qd_rad_per_s == 0.0 && self.qdd_rad_per_s2 == 0.0 {
            return self.q_rad;
        }
        SpeedChange::new(self, 0.0, bounds).end(self).q_rad
    }

    /// The velocity that remains after the acceleration has returned to zero at full jerk, rad/s.
    #[must_use]
    pub fn coming_velocity_rad_per_s(&self, bounds: &JointBounds) -> f64 {
        let a = self.qdd_rad_per_s2;
        self.qd_rad_per_s + 0.5 * a * a.abs() / bounds.jerk
    }

    /// The state `dt_s` later under full braking; at rest it stays.
    #[must_use]
    pub fn braked(&self, bounds: &JointBounds, dt_s: f64) -> Self {
        self.at_speed(0.0, bounds, dt_s)
    }

    /// The state `dt_s` later on the quickest transition to a velocity.
    ///
    /// A step of zero or less changes nothing.
    #[must_use]
    pub fn at_speed(&self, velocity_rad_per_s: f64, bounds: &JointBounds, dt_s: f64) -> Self {
        if dt_s <= 0.0 {
            return *self;
        }
        if self.is_nan() || velocity_rad_per_s.is_nan() || dt_s.is_nan() {
            return Self::nan();
        }
        let [least, most] = bounds.velocity;
        let velocity = velocity_rad_per_s.clamp(least, most);
        SpeedChange::new(self, velocity, bounds).after(self, dt_s)
    }

    /// The state `dt_s` later on the time-optimal motion to rest at `goal_rad`.
    ///
    /// The joint moves towards the goal as hard as the bounds allow until its stopping point is the goal, and then brakes. Both parts have a closed
    /// form; the switching time is the root of a monotone function. The result therefore does not depend on how time is divided into steps, the
    /// goal is reached exactly, and it is overshot only if the joint cannot stop before it. A joint that exceeds its bounds first returns within
    /// them.
    ///
    /// A step of zero or less changes nothing. Error: about 1e-15 of the angles.
    #[must_use]
    pub fn towards(&self, goal_rad: f64, bounds: &JointBounds, dt_s: f64) -> Self {
        self.towards_braking(goal_rad, bounds, bounds, dt_s)
    }

    /// As [`towards`](Self::towards), with other bounds for the final braking: for a goal in a frame whose own motion will then leave more or less
    /// acceleration for braking than now.
    #[must_use]
    pub fn towards_braking(
        &self,
        goal_rad: f64,
        bounds: &JointBounds,
        braking: &JointBounds,
        dt_s: f64,
    ) -> Self {
        if dt_s <= 0.0 {
            return *self;
        }
        if self.is_nan() || goal_rad.is_nan() || dt_s.is_nan() {
            return Self::nan();
        }
        let (at, time_s, brakes) = self.turn(goal_rad, bounds, braking, dt_s);
        if brakes {
            at.stopped(goal_rad, braking, dt_s - time_s)
        } else {
            at
        }
    }

    /// Least time until the joint rests at `goal_rad`, s.
    #[must_use]
    pub fn time_to_s(&self, goal_rad: f64, bounds: &JointBounds) -> f64 {
        if self.is_nan() || goal_rad.is_nan() {
            return f64::NAN;
        }
        let (at, time_s, _) = self.turn(goal_rad, bounds, bounds, f64::INFINITY);
        time_s + at.time_to_stop_s(bounds)
    }

    /// Time until the joint rests under full braking, s.
    #[must_use]
    pub fn time_to_stop_s(&self, bounds: &JointBounds) -> f64 {
        SpeedChange::new(self, 0.0, bounds).time_s()
    }

    /// State and time at which braking towards a goal begins, and whether that is within `most_s`.
    fn turn(
        &self,
        goal_rad: f64,
        bounds: &JointBounds,
        braking: &JointBounds,
        most_s: f64,
    ) -> (Self, f64, bool) {
        let up = self.stopping_point_rad(braking) <= goal_rad;
        // How far the stopping point is beyond the goal.
        let beyond_rad = |at: &Self| {
            let over = at.stopping_point_rad(braking) - goal_rad;
            if up { over } else { -over }
        };
        let go = SpeedChange::new(self, bounds.velocity[usize::from(up)], bounds);
        let (mut from, mut passed_s) = (*self, 0.0);
        for stretch in go.stretches {
            let left_s = most_s - passed_s;
            let whole = stretch.time_s <= left_s;
            let time_s = if whole { stretch.time_s } else { left_s };
            let to = from.jerked(stretch.jerk, time_s);
            if beyond_rad(&to) > 0.0 {
                let turn_s = root(time_s, |t| beyond_rad(&from.jerked(stretch.jerk, t)));
                return (from.jerked(stretch.jerk, turn_s), passed_s + turn_s, true);
            }
            if !whole {
                return (to, most_s, false);
            }
            (from, passed_s) = (to, passed_s + time_s);
        }
        from.qd_rad_per_s = go.end_rad_per_s;
        from.qdd_rad_per_s2 = 0.0;
        // Cruise at full speed until braking ends at the goal.
        let room = -beyond_rad(&from);
        if room > 0.0 && go.end_rad_per_s == 0.0 {
            return (from, most_s, false);
        }
        let cruise_s = (room / go.end_rad_per_s.abs()).max(0.0);
        let brakes = cruise_s < most_s - passed_s;
        let cruise_s = if brakes { cruise_s } else { most_s - passed_s };
        from.q_rad += from.qd_rad_per_s * cruise_s;
        (from, passed_s + cruise_s, brakes)
    }

    /// Braking that ends at a known stopping point.
    fn stopped(&self, end_rad: f64, bounds: &JointBounds, dt_s: f64) -> Self {
        let change = SpeedChange::new(self, 0.0, bounds);
        if dt_s >= change.time_s() {
            return Self::at_rest(end_rad);
        }
        change.after(self, dt_s)
    }
}

/// The last place in `0..=most` at which a non-decreasing function is at most zero, to rounding; it is positive at `most`.
fn root(most: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut lo, mut hi) = (0.0, most);
    let (mut f_lo, mut f_hi) = (f(lo), f(hi));
    if f_lo >= 0.0 {
        return lo;
    }
    // Regula falsi (Illinois); every fourth iteration bisects, which bounds their number.
    let mut last_low = None;
    for turn in 0..80 {
        let inner = (lo * f_hi - hi * f_lo) / (f_hi - f_lo);
        let bisect = turn % 4 == 3 || !(inner > lo && inner < hi);
        let x = if bisect { 0.5 * (lo + hi) } else { inner };
        if x <= lo || x >= hi {
            break;
        }
        let f_x = f(x);
        if f_x <= 0.0 {
            (lo, f_lo) = (x, f_x);
            if last_low == Some(true) {
                f_hi *= 0.5;
            }
            last_low = Some(true);
            if f_x == 0.0 {
                break;
            }
        } else {
            (hi, f_hi) = (x, f_x);
            if last_low == Some(false) {
                f_lo *= 0.5;
            }
            last_low = Some(false);
        }
        if hi - lo <= 1e-15 * most {
            break;
        }
    }
    lo
}
