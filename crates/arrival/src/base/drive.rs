//! The motion of a holonomic base: straight legs with limited jerk, which run into each other.

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

/// State of a base in motion: along its present leg and what is left of the one before, and about its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseState {
    /// Where the leg before ends and the present one begins, m.
    corner_m: DVec2,
    /// Directions of both.
    before: DVec2,
    direction: DVec2,
    /// On both the distance from the corner, in metres instead of radians; the law is the same. The leg before only brakes.
    ending: JointPoint,
    along: JointPoint,
    yaw: JointPoint,
}

impl BaseState {
    /// Where it is.
    #[must_use]
    pub fn pose(&self) -> BasePose {
        BasePose {
            at_m: self.corner_m + self.of_legs([self.ending.q_rad, self.along.q_rad]),
            yaw_rad: self.yaw.q_rad,
        }
    }

    /// Velocity, m/s.
    #[must_use]
    pub fn velocity_m_per_s(&self) -> DVec2 {
        self.of_legs([self.ending.qd_rad_per_s, self.along.qd_rad_per_s])
    }

    /// Acceleration, m/s².
    #[must_use]
    pub fn acceleration_m_per_s2(&self) -> DVec2 {
        self.of_legs([self.ending.qdd_rad_per_s2, self.along.qdd_rad_per_s2])
    }

    /// Turning rate, rad/s, and its derivative, rad/s².
    #[must_use]
    pub const fn turning(&self) -> [f64; 2] {
        [self.yaw.qd_rad_per_s, self.yaw.qdd_rad_per_s2]
    }

    /// Does it stand still?
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.stands() && rests(&self.yaw)
    }

    fn stands(&self) -> bool {
        rests(&self.ending) && rests(&self.along)
    }

    /// The sum of something on both legs.
    fn of_legs(&self, [ending, along]: [f64; 2]) -> DVec2 {
        self.before * ending + self.direction * along
    }
}

fn rests(point: &JointPoint) -> bool {
    point.qd_rad_per_s == 0.0 && point.qdd_rad_per_s2 == 0.0
}

/// A leg's end this near to the line of the present leg, m, is approached at the nearest point of that line.
const NEAR_M: f64 = 0.05;
/// Shorter legs are not driven, m.
const SHORTEST_M: f64 = 0.001;

/// A holonomic base on its way along a route.
///
/// Every leg is straight, from rest to rest, with limited speed, acceleration and jerk; the heading turns at the same time. The next leg begins while
/// the base brakes on the present one, at the place where it would stop: it cuts the corner. Both then have half of the acceleration and the jerk, so that
/// their sums keep the limits. Any step may be refused: the base then stops turning, and if that is refused too, it brakes.
#[derive(Debug, Clone)]
pub struct BaseDrive {
    limits: BaseLimits,
    line: JointBounds,
    /// Of both legs at a corner.
    bend: JointBounds,
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
            bend: bounds(
                limits.speed_m_per_s,
                0.5 * limits.acceleration_m_per_s2,
                0.5 * limits.jerk_m_per_s3,
            )?,
            turn: bounds(
                limits.turn_rad_per_s,
                limits.turn_rad_per_s2,
                limits.turn_rad_per_s3,
            )?,
            state: BaseState {
                corner_m: start.at_m,
                before: DVec2::X,
                direction: DVec2::X,
                ending: JointPoint::default(),
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
        let corner = place(state.corner_m, state.yaw.q_rad);
        let direction = |d: DVec2| frame.inverse_transform_vector(d.extend(0.0)).truncate();
        Self {
            state: BaseState {
                corner_m: corner.at_m,
                before: direction(state.before),
                direction: direction(state.direction),
                yaw: JointPoint {
                    q_rad: corner.yaw_rad,
                    ..state.yaw
                },
                ..*state
            },
            route_m: Vec::new(),
            yaw_rad: corner.yaw_rad,
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

    /// Sets the route from now on, m, and the heading at its end, rad, taken the shorter way round. Places that are not finite are left out.
    pub fn set_route(&mut self, route_m: &[DVec2], yaw_rad: f64) {
        self.route_m.clear();
        self.route_m
            .extend(route_m.iter().filter(|place_m| place_m.is_finite()));
        if yaw_rad.is_finite() {
            let turn_rad = (yaw_rad - self.state.yaw.q_rad + PI).rem_euclid(TAU) - PI;
            self.yaw_rad = self.state.yaw.q_rad + turn_rad;
        }
    }

    /// Is the route driven to its end?
    #[must_use]
    pub fn has_arrived(&self) -> bool {
        let at_m = self.state.pose().at_m;
        let left_m = self.route_m.last().map_or(0.0, |end| end.distance(at_m));
        left_m <= NEAR_M && self.state.is_at_rest()
    }

    /// Moves on by a time, s. `may` is asked about the state that this leads to; if it refuses, about the same without turning on; if it refuses that
    /// too, the base brakes.
    ///
    /// # Errors
    /// A time that is NaN, infinite or below zero; the state is then as it was.
    pub fn step(
        &mut self,
        dt_s: f64,
        mut may: impl FnMut(&Self, &BaseState) -> bool,
    ) -> Result<(), ArrivalError> {
        non_negative("step of the base", dt_s)?;
        let (goes_on, passed) = self.advanced(dt_s);
        let braked = self.braked(&self.state, dt_s);
        let straight = BaseState {
            yaw: braked.yaw,
            ..goes_on
        };
        let mut tried = [goes_on, straight].into_iter();
        let allowed = tried.find(|state| state.is_at_rest() || may(self, state));
        if allowed.is_some() {
            self.route_m.drain(..passed);
        }
        self.state = allowed.unwrap_or(braked);
        Ok(())
    }

    /// A state some time later under full braking.
    #[must_use]
    pub fn braked(&self, state: &BaseState, time_s: f64) -> BaseState {
        BaseState {
            ending: state.ending.braked(&self.bend, time_s),
            along: state.along.braked(self.bounds(state), time_s),
            yaw: state.yaw.braked(&self.turn, time_s),
            ..*state
        }
    }

    /// Time until a state has come to rest under full braking, s.
    #[must_use]
    pub fn stop_s(&self, state: &BaseState) -> f64 {
        let legs_s = [
            state.ending.time_to_stop_s(&self.bend),
            state.along.time_to_stop_s(self.bounds(state)),
        ];
        let turn_s = state.yaw.time_to_stop_s(&self.turn);
        legs_s.into_iter().fold(turn_s, f64::max)
    }

    /// Velocities between which all others on the way to rest lie, m/s, and the largest turning rate, rad/s. On each leg they lie between the present
    /// one, that after the acceleration has returned to zero, and rest.
    #[must_use]
    pub fn fastest(&self, state: &BaseState) -> ([DVec2; 4], f64) {
        let ends = |point: &JointPoint, bounds| {
            let coming = point.coming_velocity_rad_per_s(bounds);
            let now = point.qd_rad_per_s;
            [now.min(coming).min(0.0), now.max(coming).max(0.0)]
        };
        let [a, b] = ends(&state.ending, &self.bend);
        let [c, d] = ends(&state.along, self.bounds(state));
        let turning = state.yaw.coming_velocity_rad_per_s(&self.turn).abs();
        (
            [[a, c], [a, d], [b, c], [b, d]].map(|legs| state.of_legs(legs)),
            turning.max(state.yaw.qd_rad_per_s.abs()),
        )
    }

    /// Limits of the present leg.
    fn bounds(&self, state: &BaseState) -> &JointBounds {
        match rests(&state.ending) {
            true => &self.line,
            false => &self.bend,
        }
    }

    /// Where the next leg would begin now, m.
    #[must_use]
    pub fn stopping_m(&self) -> DVec2 {
        let state = &self.state;
        state.corner_m + state.direction * state.along.stopping_point_rad(&self.bend)
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

    /// Least time to turn by an angle from rest to rest, the shorter way round, s.
    #[must_use]
    pub fn turn_s(&self, turn_rad: f64) -> f64 {
        let turn_rad = (turn_rad + PI).rem_euclid(TAU) - PI;
        JointPoint::default().time_to_s(turn_rad, &self.turn)
    }

    /// The state after a time on the route, and how many of its places have been passed.
    fn advanced(&self, dt_s: f64) -> (BaseState, usize) {
        let (state, passed) = self.on_leg();
        let next_m = self.route_m.get(passed);
        let end_m = next_m.and_then(|next_m| self.end_on_leg_m(&state, *next_m));
        let bounds = self.bounds(&state);
        let along = match end_m {
            Some(end_m) => state.along.towards(end_m, bounds, dt_s),
            None => state.along.braked(bounds, dt_s),
        };
        let after = BaseState {
            ending: state.ending.braked(&self.bend, dt_s),
            along,
            yaw: state.yaw.towards(self.yaw_rad, &self.turn, dt_s),
            ..state
        };
        (after, passed)
    }

    /// The present state on the leg that leads on, and how many places of the route have been passed.
    fn on_leg(&self) -> (BaseState, usize) {
        let state = &self.state;
        for (passed, next_m) in self.route_m.iter().enumerate() {
            let is_last = passed + 1 == self.route_m.len();
            let end_m = self.end_on_leg_m(state, *next_m);
            match end_m.filter(|_| !state.stands()) {
                Some(_) if is_last => return (*state, passed),
                Some(end_m) if state.along.stopping_point_rad(&self.bend) < end_m => {
                    return (*state, passed);
                }
                Some(_) => {}
                None => {
                    let way_m = *next_m - self.stopping_m();
                    if way_m.length() > if is_last { SHORTEST_M } else { NEAR_M } {
                        let turned = self.turned_into(way_m.normalize());
                        return turned.map_or((*state, 0), |turned| (turned, passed));
                    }
                }
            }
        }
        (*state, 0)
    }

    /// The same state at the beginning of a leg in a direction; `None`: not yet.
    fn turned_into(&self, direction: DVec2) -> Option<BaseState> {
        let state = &self.state;
        let (along, corner) = (&state.along, state.along.stopping_point_rad(&self.bend));
        let brakes = along.qd_rad_per_s * along.qdd_rad_per_s2 <= 0.0;
        (brakes && rests(&state.ending)).then(|| BaseState {
            corner_m: self.stopping_m(),
            before: state.direction,
            direction,
            ending: JointPoint {
                q_rad: along.q_rad - corner,
                ..*along
            },
            along: JointPoint::default(),
            ..*state
        })
    }

    /// Distance of a place from the beginning of the present leg, m; `None`: it is not on it, or behind.
    fn end_on_leg_m(&self, state: &BaseState, place_m: DVec2) -> Option<f64> {
        let way_m = place_m - state.corner_m;
        let end_m = way_m.dot(state.direction);
        let is_near = way_m.perp_dot(state.direction).abs() <= NEAR_M;
        let stops_m = state.along.stopping_point_rad(self.bounds(state));
        (is_near && end_m >= stops_m - 1e-9).then_some(end_m)
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
