//! How a textured board turns and moves under a finger.

use crate::error::{finite, positive};
use crate::scan_estimate::wrapped;
use crate::{Level, ScanConfig, ScanEstimator, TextonError};
use glam::DVec2;
use std::f64::consts::PI;

/// What a board may do, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Largest speed in contact, m/s; default 0.1. Faster levels are presented at this.
    pub speed_m_per_s: f64,
    /// Largest acceleration, m/s²; default 4: 80 mm/s after 20 ms.
    pub acceleration_m_per_s2: f64,
    /// How far the board may go from where it was touched, m; default 0.08.
    pub stroke_m: f64,
    /// Half of the textured face along the board's x and y axes, m; default 0.1.
    pub half_face_m: [f64; 2],
    /// How far the finger's middle stays away from the edge of the face, m; default 0.01.
    pub margin_m: f64,
    /// Fastest turn in contact, rad/s; default 0.5, which a finger 50 mm off the middle feels as 25 mm/s.
    pub turn_rad_per_s: f64,
    /// Fastest change of the turn, rad/s²; default 4.
    pub turn_rad_per_s2: f64,
    /// Speed of the return, out of contact, m/s; default 0.25.
    pub return_speed_m_per_s: f64,
    /// Longest time that a single step moves the board on, s; default 0.05.
    pub max_step_s: f64,
    /// How the direction of the scan is estimated.
    pub scan: ScanConfig,
}

impl Default for MotionLimits {
    fn default() -> Self {
        Self {
            speed_m_per_s: 0.1,
            acceleration_m_per_s2: 4.0,
            stroke_m: 0.08,
            half_face_m: [0.1; 2],
            margin_m: 0.01,
            turn_rad_per_s: 0.5,
            turn_rad_per_s2: 4.0,
            return_speed_m_per_s: 0.25,
            max_step_s: 0.05,
            scan: ScanConfig::default(),
        }
    }
}

impl MotionLimits {
    /// Rejects what is not positive, and a margin that leaves nothing of the face.
    ///
    /// # Errors
    /// The first such setting; NaN is outside every range.
    pub fn validate(&self) -> Result<(), TextonError> {
        positive("speed_m_per_s", self.speed_m_per_s)?;
        positive("acceleration_m_per_s2", self.acceleration_m_per_s2)?;
        positive("stroke_m", self.stroke_m)?;
        for half_m in self.half_face_m {
            positive("half_face_m", half_m)?;
            positive("half_face_m less margin_m", half_m - self.margin_m)?;
        }
        if self.margin_m < 0.0 {
            return Err(TextonError::Parameter {
                what: "margin_m",
                value: self.margin_m,
                wanted: "at least 0",
            });
        }
        positive("turn_rad_per_s", self.turn_rad_per_s)?;
        positive("turn_rad_per_s2", self.turn_rad_per_s2)?;
        positive("return_speed_m_per_s", self.return_speed_m_per_s)?;
        positive("max_step_s", self.max_step_s)?;
        self.scan.validate()
    }
}

/// The finger on the board, in the plane of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerState {
    /// Where it touches, m, from the middle of the board where that is at displacement zero.
    pub point_m: DVec2,
    /// Its velocity along the surface, m/s.
    pub velocity_m_per_s: DVec2,
}

/// What kept the board from the wanted motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// The level is faster than the board may be.
    Speed,
    /// The finger would run off the face.
    Face,
    /// The stroke, or what of it is reachable, is used up.
    Stroke,
    /// The board still speeds up, slows down or changes direction.
    Acceleration,
    /// The board has not turned to the scan yet (by a degree or more).
    Turn,
}

/// Where the board shall be now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionStep {
    /// Turn about the surface's normal, rad; 0: the bumps' long axis along the plane's x axis.
    pub roll_rad: f64,
    /// Rate of the turn, rad/s; 0 out of contact, where the roll may leap.
    pub roll_rad_per_s: f64,
    /// From where the board was touched, m.
    pub displacement_m: DVec2,
    /// Velocity of the board, m/s.
    pub velocity_m_per_s: DVec2,
    /// Speed of the finger relative to the texture under it, m/s; 0 out of contact.
    pub relative_speed_m_per_s: f64,
    /// The first limit that holds it back.
    pub limited: Option<Limit>,
}

/// Below this the board counts as where it shall be.
const ALIKE: f64 = 1e-9;
/// The board counts as turned to the scan below this, rad: one degree.
const TURNED_RAD: f64 = PI / 180.0;
/// Distance of the places that [`TextureMotion::limit_stroke`] asks about, m.
const PROBE_M: f64 = 0.005;

/// Turns a textured board to the scan and moves it against the scan.
///
/// The plane is that of the surface, seen from the finger: x to the right, y upwards, angles from x
/// towards y (the axes that a board has at roll 0). A [`Level`] asks for an angle θ between scan and long
/// axis, so the board turns to the direction of the scan plus θ, modulo half a turn; and for a
/// speed v, which is the board's own against the scan: a finger at rest feels v, one that scans at s
/// feels s + v.
///
/// Out of contact the roll follows the expected scan at once and the board goes back to displacement
/// zero; in contact both obey the limits. Time comes in as an argument; nothing is allocated.
#[derive(Debug, Clone)]
pub struct TextureMotion {
    limits: MotionLimits,
    scan: ScanEstimator,
    last_s: Option<f64>,
    touched: bool,
    roll_rad: f64,
    /// The roll at which the next touch finds the board, where it was told.
    stands_rad: Option<f64>,
    roll_rad_per_s: f64,
    displacement_m: DVec2,
    velocity_m_per_s: DVec2,
    /// Reachable strokes: along an axis, and how far against it and with it, m.
    reach_axis: DVec2,
    reach_m: [f64; 2],
}

impl TextureMotion {
    /// A board at rest that expects a scan along x.
    ///
    /// # Errors
    /// As [`MotionLimits::validate`].
    pub fn new(limits: MotionLimits) -> Result<Self, TextonError> {
        limits.validate()?;
        Ok(Self {
            limits,
            scan: ScanEstimator::new(limits.scan, 0.0)?,
            last_s: None,
            touched: false,
            roll_rad: 0.0,
            stands_rad: None,
            roll_rad_per_s: 0.0,
            displacement_m: DVec2::ZERO,
            velocity_m_per_s: DVec2::ZERO,
            reach_axis: DVec2::X,
            reach_m: [limits.stroke_m; 2],
        })
    }

    /// The limits.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The estimate of the scan, to be told what to expect before the contact.
    pub const fn scan_mut(&mut self) -> &mut ScanEstimator {
        &mut self.scan
    }

    /// The direction of the scan, rad.
    #[must_use]
    pub const fn scan_rad(&self) -> f64 {
        self.scan.direction_rad()
    }

    /// The roll for a level and the present scan, rad, in -π/2..=π/2; half a turn more feels the same.
    #[must_use]
    pub fn roll_for(&self, level: &Level) -> f64 {
        nearest_half_turn(self.scan.direction_rad() + level.scan.rad(), 0.0)
    }

    /// Tells at which roll (rad) the board really stands when the next touch begins. A board that was late
    /// or could not take the roll of its level turns on from there.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn stands_at(&mut self, roll_rad: f64) -> Result<(), TextonError> {
        finite("roll_rad", roll_rad)?;
        self.stands_rad = Some(roll_rad);
        Ok(())
    }

    /// Shortens the stroke to what is reachable from the present place: asks for displacements (m) with
    /// the roll of the level (rad), every 5 mm along the expected scan, outwards until the first refusal.
    /// Returns how far the board may go against and with the scan, m; 0 where not even the
    /// place itself is reachable. Holds until asked again.
    pub fn limit_stroke(
        &mut self,
        level: &Level,
        mut reachable: impl FnMut(DVec2, f64) -> bool,
    ) -> [f64; 2] {
        let roll_rad = self.roll_for(level);
        self.reach_axis = DVec2::from_angle(self.scan.direction_rad());
        let most = self.limits.stroke_m;
        let here = reachable(DVec2::ZERO, roll_rad);
        self.reach_m = [-1.0, 1.0].map(|side| {
            let mut reach_m = 0.0;
            while here && reach_m < most {
                let next_m = f64::min(reach_m + PROBE_M, most);
                if !reachable(self.reach_axis * (side * next_m), roll_rad) {
                    break;
                }
                reach_m = next_m;
            }
            reach_m
        });
        self.reach_m
    }

    /// The motion at a time, s, for the finger (`None`: no contact) and the level that it shall feel.
    ///
    /// A clock that stands still or runs backwards moves nothing.
    ///
    /// # Errors
    /// A time, a finger or a speed that is NaN or infinite; nothing is then changed.
    pub fn step(
        &mut self,
        t_s: f64,
        finger: Option<FingerState>,
        level: &Level,
    ) -> Result<MotionStep, TextonError> {
        finite("t_s", t_s)?;
        crate::roughness::speed(level.speed_mm_per_s)?;
        if let Some(finger) = finger {
            finite("place of the finger", finger.point_m.length())?;
            finite("speed of the finger", finger.velocity_m_per_s.length())?;
        }
        let elapsed_s = self.last_s.replace(t_s).map_or(0.0, |last| t_s - last);
        let dt_s = elapsed_s.clamp(0.0, self.limits.max_step_s);
        match finger {
            Some(finger) => self.touched_step(dt_s, &finger, level),
            None => Ok(self.free_step(dt_s, level)),
        }
    }

    fn touched_step(
        &mut self,
        dt_s: f64,
        finger: &FingerState,
        level: &Level,
    ) -> Result<MotionStep, TextonError> {
        if !self.touched {
            self.touched = true;
            // Unless told otherwise the board stands as expected; a finger that scans another way is
            // believed at once.
            let stands_rad = self.stands_rad.take();
            self.roll_rad = stands_rad.unwrap_or_else(|| self.roll_for(level));
            self.scan.expect_from_approach(finger.velocity_m_per_s)?;
        }
        let scan_rad = self.scan.step(dt_s, finger.velocity_m_per_s)?;
        let wanted_roll = nearest_half_turn(scan_rad + level.scan.rad(), self.roll_rad);
        let wanted = level.speed_mm_per_s * 1e-3;
        let scan = DVec2::from_angle(scan_rad);
        let face = self.speed_on_face(finger, scan, dt_s);
        let stroke = self.speed_within(self.stroke_left(-scan), dt_s);
        let speed = wanted.min(self.limits.speed_m_per_s).min(face).min(stroke);
        let Change { reached, braked } = self.accelerate(-scan * speed, dt_s);
        // The speed is felt before the orientation: both would share what the joints can do.
        let left_rad = if reached {
            wanted_roll - self.roll_rad
        } else {
            0.0
        };
        self.turn(left_rad, dt_s);
        let limited = if wanted > self.limits.speed_m_per_s {
            Some(Limit::Speed)
        } else if face < wanted && face <= stroke {
            Some(Limit::Face)
        } else if stroke < wanted || braked {
            Some(Limit::Stroke)
        } else if !reached {
            Some(Limit::Acceleration)
        } else if (wanted_roll - self.roll_rad).abs() > TURNED_RAD {
            Some(Limit::Turn)
        } else {
            None
        };
        let arm = finger.point_m - self.displacement_m;
        let texture = self.velocity_m_per_s + self.roll_rad_per_s * arm.perp();
        Ok(MotionStep {
            roll_rad: self.roll_rad,
            roll_rad_per_s: self.roll_rad_per_s,
            displacement_m: self.displacement_m,
            velocity_m_per_s: self.velocity_m_per_s,
            relative_speed_m_per_s: (finger.velocity_m_per_s - texture).length(),
            limited,
        })
    }

    fn free_step(&mut self, dt_s: f64, level: &Level) -> MotionStep {
        self.touched = false;
        self.roll_rad = self.roll_for(level);
        self.roll_rad_per_s = 0.0;
        let left = self.displacement_m.length();
        let speed = self.speed_within(left, dt_s);
        let speed = speed.min(self.limits.return_speed_m_per_s);
        let home = -self.displacement_m.normalize_or_zero();
        let Change { reached, .. } = self.accelerate(home * speed, dt_s);
        if self.displacement_m.length() < ALIKE && self.velocity_m_per_s.length() < ALIKE {
            self.displacement_m = DVec2::ZERO;
            self.velocity_m_per_s = DVec2::ZERO;
        }
        MotionStep {
            roll_rad: self.roll_rad,
            roll_rad_per_s: 0.0,
            displacement_m: self.displacement_m,
            velocity_m_per_s: self.velocity_m_per_s,
            relative_speed_m_per_s: 0.0,
            limited: (!reached).then_some(Limit::Acceleration),
        }
    }

    /// Turns on towards an angle this far away, within the limits.
    fn turn(&mut self, left_rad: f64, dt_s: f64) {
        let most = self.limits.turn_rad_per_s2 * dt_s;
        // From this rate it stops in time, after one more step.
        let stops =
            (most * most + 2.0 * self.limits.turn_rad_per_s2 * left_rad.abs()).sqrt() - most;
        let wanted = left_rad.signum() * stops.min(self.limits.turn_rad_per_s);
        let before = self.roll_rad_per_s;
        self.roll_rad_per_s += (wanted - before).clamp(-most, most);
        self.roll_rad += 0.5 * dt_s * (before + self.roll_rad_per_s);
    }

    /// Moves on towards a velocity, unless the board could then no longer stop within its stroke: it
    /// brakes instead, which it always can.
    fn accelerate(&mut self, velocity_m_per_s: DVec2, dt_s: f64) -> Change {
        let (place, before) = (self.displacement_m, self.velocity_m_per_s);
        let mut braked = false;
        for wanted in [velocity_m_per_s, DVec2::ZERO] {
            let a = self.limits.acceleration_m_per_s2;
            let change = (wanted - before).clamp_length_max(a * dt_s);
            let after = before + change;
            // A change that takes less than the step is over before its end.
            let ramp_s = (change.length() / a).min(dt_s);
            self.velocity_m_per_s = after;
            self.displacement_m = place + 0.5 * ramp_s * (before + after) + (dt_s - ramp_s) * after;
            let left = self.stroke_left(self.velocity_m_per_s.normalize_or_zero());
            let need = self.velocity_m_per_s.length_squared() / (2.0 * a);
            braked = wanted != velocity_m_per_s;
            if need <= left {
                break;
            }
        }
        Change {
            reached: (velocity_m_per_s - self.velocity_m_per_s).length() < ALIKE,
            braked,
        }
    }

    /// Speed from which the board, after one more step, stops within a distance, m/s.
    fn speed_within(&self, left_m: f64, dt_s: f64) -> f64 {
        let a = self.limits.acceleration_m_per_s2;
        let step = a * dt_s;
        (step * step + 2.0 * a * left_m.max(0.0)).sqrt() - step
    }

    /// Speed from which the board stops before a finger that goes on as it does leaves the face.
    fn speed_on_face(&self, finger: &FingerState, scan: DVec2, dt_s: f64) -> f64 {
        let to_board = DVec2::from_angle(-self.roll_rad);
        let at = to_board.rotate(finger.point_m - self.displacement_m);
        let along = to_board.rotate(scan);
        let mut left = f64::INFINITY;
        for axis in 0..2 {
            let half = self.limits.half_face_m[axis] - self.limits.margin_m;
            if along[axis] != 0.0 {
                left = left.min((half.copysign(along[axis]) - at[axis]) / along[axis]);
            }
        }
        let a = self.limits.acceleration_m_per_s2;
        let own = finger.velocity_m_per_s.dot(scan).max(0.0) + a * dt_s;
        (own * own + 2.0 * a * left.max(0.0)).sqrt() - own
    }

    /// How far the board may still go along a direction, m.
    fn stroke_left(&self, along: DVec2) -> f64 {
        let at = self.displacement_m;
        // Out of the disc of the stroke.
        let radius = self.limits.stroke_m;
        let b = at.dot(along);
        let inside = b * b + radius * radius - at.length_squared();
        let disc = if inside > 0.0 { inside.sqrt() - b } else { 0.0 };
        // Out of the reachable strip across the expected scan.
        let rate = along.dot(self.reach_axis);
        let place = at.dot(self.reach_axis);
        let strip = if rate > ALIKE {
            (self.reach_m[1] - place) / rate
        } else if rate < -ALIKE {
            (place + self.reach_m[0]) / -rate
        } else {
            f64::INFINITY
        };
        disc.min(strip).max(0.0)
    }
}

/// How a step towards a velocity went.
#[derive(Debug, Clone, Copy)]
struct Change {
    reached: bool,
    /// It had to brake instead.
    braked: bool,
}

/// The angle modulo half a turn that is nearest to another one.
fn nearest_half_turn(angle_rad: f64, to_rad: f64) -> f64 {
    let turn = wrapped(2.0 * (angle_rad - to_rad)) / 2.0;
    to_rad + turn
}

/// Rejects steps that are negative or not finite.
pub(crate) fn step_time(dt_s: f64) -> Result<(), TextonError> {
    finite("dt_s", dt_s)?;
    if dt_s < 0.0 {
        return Err(TextonError::Parameter {
            what: "dt_s",
            value: dt_s,
            wanted: "at least 0",
        });
    }
    Ok(())
}
