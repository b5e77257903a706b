//! The motion of a holonomic base: straight legs with limited jerk, each from rest to rest.

use crate::error::ArrivalError;
use glam::{DMat2, DVec2, DVec3};
use hwall_geometry::Pose;
use hwall_motion::{JointBounds, JointPoint, MotionError};
use hwall_numeric::check::{all_finite, non_negative};
use std::f64::consts::{PI, TAU};

/// Limits of a holonomic base. The defaults of speed and acceleration are those of the study in docs/ENVIRONMENTS.md; the others are assumptions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseLimits {
    /// Largest speed, m/s; default 0.8.
    pub speed_m_per_s: f64,
    /// Largest acceleration, also for braking, m/s²; default 0.8.
    pub acceleration_m_per_s2: f64,
    /// Largest jerk, m/s³; default 8: full acceleration after 0.1 s.
    pub jerk_m_per_s3: f64,
    /// Largest turning rate, rad/s; default 1.
    pub turn_rad_per_s: f64,
    /// Largest angular acceleration, rad/s²; default 1.5.
    pub turn_rad_per_s2: f64,
    /// Largest angular jerk, rad/s³; default 15.
    pub turn_rad_per_s3: f64,
}

impl Default for BaseLimits {
    fn default() -> Self {
        Self {
            speed_m_per_s: 0.8,
            acceleration_m_per_s2: 0.8,
            jerk_m_per_s3: 8.0,
            turn_rad_per_s: 1.0,
            turn_rad_per_s2: 1.5,
            turn_rad_per_s3: 15.0,
        }
    }
}

/// A place of the base on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BasePose {
    /// Its axis, m.
    pub at_m: DVec2,
    /// Its heading about z, rad.
    pub yaw_rad: f64,
}

impl BasePose {
    pub(super) fn is_finite(&self) -> bool {
        self.at_m.is_finite() && self.yaw_rad.is_finite()
    }

    /// `floor_from_base`, with the base at height zero.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn floor_from_base(&self) -> Result<Pose, ArrivalError> {
        Ok(Pose::from_yaw(self.yaw_rad, self.at_m.extend(0.0))?)
    }

    /// A point of the base frame on the floor, m.
    #[must_use]
    pub fn floor_m(&self, base_m: DVec2) -> DVec2 {
        self.at_m + DMat2::from_angle(self.yaw_rad) * base_m
    }

    /// The same place in a frame with this pose.
    #[must_use]
    pub fn seen_from(&self, frame: &Pose) -> Self {
        let x = frame.rotation().x_axis;
        Self {
            at_m: frame
                .inverse_transform_point(self.at_m.extend(0.0))
                .truncate(),
            yaw_rad: self.yaw_rad - x.y.atan2(x.x),
        }
    }

    /// The same place in the frame in which this frame has this pose.
    #[must_use]
    pub fn placed(&self, frame: &Pose) -> Self {
        let x = frame.rotation().x_axis;
        let at: DVec3 = frame.transform_point(self.at_m.extend(0.0));
        Self {
            at_m: at.truncate(),
            yaw_rad: self.yaw_rad + x.y.atan2(x.x),
        }
    }
}

/// State of a base in motion: along its present leg, and about its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseState {
    from_m: DVec2,
    direction: DVec2,
    /// Distance from the beginning of the leg, in metres instead of radians; the law is the same.
    along: JointPoint,
    yaw: JointPoint,
}

impl BaseState {
    /// Where it is.
    #[must_use]
    pub fn pose(&self) -> BasePose {
        BasePose {
            at_m: self.from_m + self.direction * self.along.q_rad,
            yaw_rad: self.yaw.q_rad,
        }
    }

    /// Velocity, m/s.
    #[must_use]
    pub fn velocity_m_per_s(&self) -> DVec2 {
        self.direction * self.along.qd_rad_per_s
    }

    /// Acceleration, m/s².
    #[must_use]
    pub fn acceleration_m_per_s2(&self) -> DVec2 {
        self.direction * self.along.qdd_rad_per_s2
    }

    /// Turning rate, rad/s, and its derivative, rad/s².
    #[must_use]
    pub const fn turning(&self) -> [f64; 2] {
        [self.yaw.qd_rad_per_s, self.yaw.qdd_rad_per_s2]
    }

    /// Does it stand still?
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        rests(&self.along) && rests(&self.yaw)
    }
}

fn rests(point: &JointPoint) -> bool {
    point.qd_rad_per_s == 0.0 && point.qdd_rad_per_s2 == 0.0
}

/// A leg's end this near to the line of the present leg, m, is approached without stopping, at the nearest point of that line.
pub(super) const NEAR_M: f64 = 0.05;
/// Shorter legs are not driven, m.
const SHORTEST_M: f64 = 0.001;

/// A holonomic base on its way along a route.
///
/// Every leg is straight, from rest to rest, with limited speed, acceleration and jerk; the heading turns at the same time. A new route begins once
/// the base has stopped, unless its first leg continues the present one. Any step may be refused: the base then brakes, on the line that it is on.
#[derive(Debug, Clone)]
pub struct BaseDrive {
    limits: BaseLimits,
    line: JointBounds,
    turn: JointBounds,
    state: BaseState,
    route_m: Vec<DVec2>,
    yaw_rad: f64,
}

impl BaseDrive {
    /// At rest.
    ///
    /// # Errors
    /// A limit outside 1e-9 to 1e12, or a start that is not finite.
    pub fn new(limits: BaseLimits, start: BasePose) -> Result<Self, ArrivalError> {
        all_finite(
            "start of the base",
            &[start.at_m.x, start.at_m.y, start.yaw_rad],
        )?;
        let bounds = |v, a, j| JointBounds::new(v, a, j).map_err(argument);
        Ok(Self {
            limits,
            line: bounds(
                limits.speed_m_per_s,
                limits.acceleration_m_per_s2,
                limits.jerk_m_per_s3,
            )?,
            turn: bounds(
                limits.turn_rad_per_s,
                limits.turn_rad_per_s2,
                limits.turn_rad_per_s3,
            )?,
            state: BaseState {
                from_m: start.at_m,
                direction: DVec2::X,
                along: JointPoint::default(),
                yaw: JointPoint::new(start.yaw_rad, 0.0, 0.0),
            },
            route_m: Vec::new(),
            yaw_rad: start.yaw_rad,
        })
    }

    /// The same motion seen from a frame with this pose, without its route.
    #[must_use]
    pub fn seen_from(&self, frame: &Pose) -> Self {
        let place = |at_m, yaw_rad| BasePose { at_m, yaw_rad }.seen_from(frame);
        let state = &self.state;
        let begin = place(state.from_m, state.yaw.q_rad);
        let direction = frame.inverse_transform_vector(state.direction.extend(0.0));
        Self {
            state: BaseState {
                from_m: begin.at_m,
                direction: direction.truncate(),
                yaw: JointPoint {
                    q_rad: begin.yaw_rad,
                    ..state.yaw
                },
                ..*state
            },
            route_m: Vec::new(),
            yaw_rad: begin.yaw_rad,
            ..*self
        }
    }

    /// Its limits.
    #[must_use]
    pub const fn limits(&self) -> &BaseLimits {
        &self.limits
    }

    /// Its state after the last step.
    #[must_use]
    pub const fn state(&self) -> &BaseState {
        &self.state
    }

    /// Sets the route from now on, m, and the heading at its end, rad, taken the shorter way round.
    ///
    /// # Errors
    /// A place or a heading that is not finite. The base then has no route, and brakes: without a corner the way may lead through what it goes around.
    pub fn set_route(&mut self, route_m: &[DVec2], yaw_rad: f64) -> Result<(), ArrivalError> {
        self.route_m.clear();
        self.yaw_rad = self.state.yaw.stopping_point_rad(&self.turn);
        for place_m in route_m {
            all_finite("route of the base", &place_m.to_array())?;
        }
        all_finite("heading of the base", &[yaw_rad])?;
        self.route_m.extend(route_m);
        let turn_rad = (yaw_rad - self.state.yaw.q_rad + PI).rem_euclid(TAU) - PI;
        self.yaw_rad = self.state.yaw.q_rad + turn_rad;
        Ok(())
    }

    /// Is the route driven to its end?
    #[must_use]
    pub fn has_arrived(&self) -> bool {
        let at_m = self.state.pose().at_m;
        let left_m = self.route_m.last().map_or(0.0, |end| end.distance(at_m));
        left_m <= NEAR_M && self.state.is_at_rest()
    }

    /// Moves on by a time, s. `may` is asked about the state that this leads to; if it refuses, the base brakes instead.
    ///
    /// # Errors
    /// A time that is NaN, infinite or below zero; the state is then as it was.
    pub fn step(
        &mut self,
        dt_s: f64,
        may: impl FnOnce(&Self, &BaseState) -> bool,
    ) -> Result<(), ArrivalError> {
        non_negative("step of the base", dt_s)?;
        let goes_on = self.advanced(dt_s);
        let refused = !goes_on.is_at_rest() && !may(self, &goes_on);
        self.state = if refused {
            self.braked(&self.state, dt_s)
        } else {
            goes_on
        };
        Ok(())
    }

    /// A state some time later under full braking.
    #[must_use]
    pub fn braked(&self, state: &BaseState, time_s: f64) -> BaseState {
        BaseState {
            along: state.along.braked(&self.line, time_s),
            yaw: state.yaw.braked(&self.turn, time_s),
            ..*state
        }
    }

    /// Time until a state has come to rest under full braking, s.
    #[must_use]
    pub fn stop_s(&self, state: &BaseState) -> f64 {
        let along_s = state.along.time_to_stop_s(&self.line);
        along_s.max(state.yaw.time_to_stop_s(&self.turn))
    }

    /// Velocities, m/s, and the largest turning rate, rad/s, on the way to rest: the present ones, and those after the acceleration has returned to
    /// zero. All others lie between them and rest.
    #[must_use]
    pub fn fastest(&self, state: &BaseState) -> ([DVec2; 2], f64) {
        let coming = state.along.coming_velocity_rad_per_s(&self.line);
        let turning = state.yaw.coming_velocity_rad_per_s(&self.turn).abs();
        (
            [state.velocity_m_per_s(), state.direction * coming],
            turning.max(state.yaw.qd_rad_per_s.abs()),
        )
    }

    /// Where the present leg can end at the soonest, m.
    #[must_use]
    pub fn stopping_m(&self) -> DVec2 {
        self.state.from_m + self.state.direction * self.state.along.stopping_point_rad(&self.line)
    }

    /// Least time for a distance from rest to rest at a share of the speed, s.
    #[must_use]
    pub fn leg_s(&self, distance_m: f64, speed_m_per_s: f64) -> f64 {
        let bounds = JointBounds::new(
            speed_m_per_s.clamp(1e-3, self.limits.speed_m_per_s),
            self.limits.acceleration_m_per_s2,
            self.limits.jerk_m_per_s3,
        );
        bounds.map_or(f64::INFINITY, |bounds| {
            JointPoint::default().time_to_s(distance_m, &bounds)
        })
    }

    /// Time until a route with this first place begins, s: 0 if it continues the present leg.
    #[must_use]
    pub fn begins_s(&self, first_m: Option<DVec2>) -> f64 {
        match first_m {
            Some(first_m) if self.end_on_leg_m(first_m).is_some() => 0.0,
            _ => self.state.along.time_to_stop_s(&self.line),
        }
    }

    /// Least time to turn by an angle from rest to rest, the shorter way round, s.
    #[must_use]
    pub fn turn_s(&self, turn_rad: f64) -> f64 {
        let turn_rad = (turn_rad + PI).rem_euclid(TAU) - PI;
        JointPoint::default().time_to_s(turn_rad, &self.turn)
    }

    fn advanced(&mut self, dt_s: f64) -> BaseState {
        if rests(&self.state.along) {
            self.begin_leg();
        }
        let state = &self.state;
        let along = match self.leg_end_m() {
            Some(end_m) => state.along.towards(end_m, &self.line, dt_s),
            None => state.along.braked(&self.line, dt_s),
        };
        BaseState {
            along,
            yaw: state.yaw.towards(self.yaw_rad, &self.turn, dt_s),
            ..*state
        }
    }

    fn begin_leg(&mut self) {
        let at_m = self.state.pose().at_m;
        while let Some(&next_m) = self.route_m.first() {
            let is_last = self.route_m.len() == 1;
            let way_m = next_m - at_m;
            if way_m.length() > if is_last { SHORTEST_M } else { NEAR_M } {
                self.state.from_m = at_m;
                self.state.direction = way_m.normalize();
                self.state.along = JointPoint::default();
                return;
            }
            if is_last {
                return;
            }
            self.route_m.remove(0);
        }
    }

    /// End of the present leg from its beginning, m; `None`: the route leads elsewhere.
    fn leg_end_m(&self) -> Option<f64> {
        self.end_on_leg_m(*self.route_m.first()?)
    }

    fn end_on_leg_m(&self, place_m: DVec2) -> Option<f64> {
        let state = &self.state;
        let way_m = place_m - state.from_m;
        let end_m = way_m.dot(state.direction);
        let is_near = way_m.perp_dot(state.direction).abs() <= NEAR_M;
        let ahead = end_m >= state.along.stopping_point_rad(&self.line) - 1e-9;
        (is_near && ahead).then_some(end_m)
    }
}

/// A limit that the motion refuses.
fn argument(error: MotionError) -> ArrivalError {
    match error {
        MotionError::Argument(error) => error.into(),
        _ => ArrivalError::Empty {
            what: "motion of the base",
        },
    }
}
