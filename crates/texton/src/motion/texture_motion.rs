//! How a textured board turns and moves under a finger.

use super::limits::MotionLimits;
use super::scan_estimate::{ScanEstimator, wrapped};
use crate::error::Result;
use crate::levels::Level;
use glam::DVec2;
use hwall_numeric::check::{finite, non_negative};
use std::f64::consts::PI;

/// The finger on the board, in the plane of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerState {
    /// Point of touch, m, from the middle of the board at displacement zero.
    pub point_m: DVec2,
    /// Velocity of the finger along the surface, m/s.
    pub velocity_m_per_s: DVec2,
}

/// Reachable displacement of a board since the touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Against the scan, m.
    pub against_m: f64,
    /// Along the scan, m.
    pub along_m: f64,
}

/// What restricts the wanted motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// The level is faster than the board's speed limit.
    Speed,
    /// The finger would run off the face.
    Face,
    /// The stroke, or its reachable part, is used up.
    Stroke,
    /// The board is still speeding up, slowing down or changing direction.
    Acceleration,
    /// The board has not turned to the scan yet (error of more than a degree).
    Turn,
}

/// Pose and velocity that the board must have now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionStep {
    /// Turn about the normal of the surface, rad; at 0 the long axis of the bumps is along the x axis of the plane.
    pub roll_rad: f64,
    /// Rate of the turn, rad/s; 0 out of contact, where the roll may jump.
    pub roll_rad_per_s: f64,
    /// Displacement since the touch, m.
    pub displacement_m: DVec2,
    /// Velocity of the board, m/s.
    pub velocity_m_per_s: DVec2,
    /// Speed of the finger relative to the texture under it, m/s; 0 out of contact.
    pub relative_speed_m_per_s: f64,
    /// The first limit that restricts the motion.
    pub limited: Option<Limit>,
}

/// Below this the board counts as back at displacement zero and at rest, m or m/s.
const ALIKE: f64 = 1e-9;
/// The board turns to the other side of its bumps if that is nearer by this, rad: 5 degrees, beyond the noise of the direction of a scan.
const SIDE_RAD: f64 = 0.0873;
/// The board counts as turned to the scan below this, rad: one degree.
const TURNED_RAD: f64 = PI / 180.0;
/// Distance between the displacements that [`TextureMotion::limit_stroke`] checks, m.
const PROBE_M: f64 = 0.005;

/// Turns a textured board to the scan and moves it against the scan.
///
/// Frame: the plane of the surface, seen from the finger: x to the right, y upwards, angles from x
/// towards y (the axes of a board at roll 0). A [`Level`] demands an angle θ between scan and long
/// axis, so the board turns to the direction of the scan plus or minus θ, modulo half a turn. It also demands a speed v of the
/// board against the scan: a finger at rest feels v, a finger scanning at s feels s + v.
///
/// A board turns slowly. Until it has turned, it also moves sideways, so that the velocity of the finger over the board already has
/// the angle θ to the bumps, as far as the speed limit allows. Up to about 0.1 m/s, curved scans thus meet the bumps closer to that
/// angle, although the board cannot follow their turns.
///
/// Out of contact the roll follows the expected scan at once and the board returns to displacement
/// zero; in contact both obey the limits. Time is an argument; nothing is allocated.
#[derive(Debug, Clone)]
pub struct TextureMotion {
    limits: MotionLimits,
    scan: ScanEstimator,
    last_s: Option<f64>,
    touched: bool,
    roll_rad: f64,
    /// Actual roll of the board at the next touch, if known.
    stands_rad: Option<f64>,
    /// Towards which side of its bumps the board turns.
    turns_left: bool,
    roll_rad_per_s: f64,
    displacement_m: DVec2,
    velocity_m_per_s: DVec2,
    /// Scan direction for which `reachable` was found.
    stroke_axis: DVec2,
    reachable: Stroke,
    /// The next check, and its roll.
    probing: Option<(Probe, f64)>,
}

/// Displacement whose reachability is checked.
#[derive(Debug, Clone, Copy)]
enum Probe {
    Here,
    Against,
    Along,
}

impl TextureMotion {
    /// A board at rest that expects a scan along x.
    ///
    /// # Errors
    /// As [`MotionLimits::validate`].
    pub fn new(limits: MotionLimits) -> Result<Self> {
        limits.validate()?;
        Ok(Self {
            limits,
            scan: ScanEstimator::new(limits.scan, 0.0)?,
            last_s: None,
            touched: false,
            roll_rad: 0.0,
            stands_rad: None,
            turns_left: true,
            roll_rad_per_s: 0.0,
            displacement_m: DVec2::ZERO,
            velocity_m_per_s: DVec2::ZERO,
            stroke_axis: DVec2::X,
            reachable: Stroke {
                against_m: limits.stroke_m,
                along_m: limits.stroke_m,
            },
            probing: None,
        })
    }

    /// The limits.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The estimate of the scan, for setting the expected direction before the contact.
    pub const fn scan_mut(&mut self) -> &mut ScanEstimator {
        &mut self.scan
    }

    /// The direction of the scan, rad.
    #[must_use]
    pub const fn scan_rad(&self) -> f64 {
        self.scan.direction_rad()
    }

    /// The roll for a level and the present scan, rad, from -π/2 to π/2; half a turn more feels the same.
    #[must_use]
    pub fn roll_for(&self, level: &Level) -> f64 {
        nearest_half_turn(self.scan.direction_rad() + level.scan.rad(), 0.0)
    }

    /// Sets the actual roll (rad) of the board at the next touch. A board that was late, or could
    /// not take the roll of its level, starts to turn from this roll.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn stands_at(&mut self, roll_rad: f64) -> Result<()> {
        finite("roll_rad", roll_rad)?;
        self.stands_rad = Some(roll_rad);
        Ok(())
    }

    /// Shortens the stroke to its reachable part: calls `reachable` with displacements (m) and the roll
    /// of the level (rad), every 5 mm along the expected scan, outwards until the first refusal. Both
    /// ends are 0 if the present pose itself is unreachable. The result stays valid until the next call.
    pub fn limit_stroke(
        &mut self,
        level: &Level,
        mut reachable: impl FnMut(DVec2, f64) -> bool,
    ) -> Stroke {
        self.begin_stroke(level);
        while self.probe_stroke(&mut reachable) {}
        self.reachable
    }

    /// [`limit_stroke`](Self::limit_stroke) in pieces, for a control loop. The stroke is zero until
    /// [`probe_stroke`](Self::probe_stroke) extends it.
    pub fn begin_stroke(&mut self, level: &Level) {
        self.stroke_axis = DVec2::from_angle(self.scan.direction_rad());
        self.reachable = Stroke {
            against_m: 0.0,
            along_m: 0.0,
        };
        self.probing = Some((Probe::Here, self.roll_for(level)));
    }

    /// Are there displacements left to check?
    #[must_use]
    pub const fn is_probing(&self) -> bool {
        self.probing.is_some()
    }

    /// Checks one more displacement; returns whether more are left. Displacements against the scan come first, because the board moves
    /// there.
    pub fn probe_stroke(&mut self, mut reachable: impl FnMut(DVec2, f64) -> bool) -> bool {
        let Some((probe, roll_rad)) = self.probing else {
            return false;
        };
        let most = self.limits.stroke_m;
        let Stroke { against_m, along_m } = &mut self.reachable;
        let (far_m, side, next) = match probe {
            Probe::Here => {
                let is_held = reachable(DVec2::ZERO, roll_rad);
                self.probing = is_held.then_some((Probe::Against, roll_rad));
                return is_held;
            }
            Probe::Against => (against_m, -1.0, Some((Probe::Along, roll_rad))),
            Probe::Along => (along_m, 1.0, None),
        };
        let next_m = f64::min(*far_m + PROBE_M, most);
        let is_further = *far_m < most && reachable(self.stroke_axis * (side * next_m), roll_rad);
        match is_further {
            true => *far_m = next_m,
            false => self.probing = next,
        }
        self.probing.is_some()
    }

    /// Motion at time `t_s`, s, for the finger (`None`: no contact) and the level to present.
    ///
    /// The board does not move if the clock stops or runs backwards.
    ///
    /// # Errors
    /// A time, a finger or a speed that is NaN or infinite, or a negative speed; the motion then stays as it was.
    pub fn step(
        &mut self,
        t_s: f64,
        finger: Option<FingerState>,
        level: &Level,
    ) -> Result<MotionStep> {
        finite("t_s", t_s)?;
        non_negative("speed_mm_per_s", level.speed_mm_per_s)?;
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
    ) -> Result<MotionStep> {
        if !self.touched {
            self.touched = true;
            // Unless its roll was set, the board stands at the expected roll. A scan in another direction is adopted at
            // once.
            let stands_rad = self.stands_rad.take();
            self.roll_rad = stands_rad.unwrap_or_else(|| self.roll_for(level));
            self.scan.expect_from_approach(finger.velocity_m_per_s)?;
        }
        let scan_rad = self.scan.step(dt_s, finger.velocity_m_per_s)?;
        let wanted_roll = self.nearer_roll(scan_rad, level);
        let wanted = level.speed_mm_per_s * 1e-3;
        // Direction over the board that has the level's angle to the bumps before the board has turned.
        let over = DVec2::from_angle(scan_rad + self.roll_rad - wanted_roll);
        let own = self.scan.velocity_m_per_s();
        let along = own.dot(over);
        // A finger that the board drags along moves against the scan; the board must not chase it.
        let keeps = if along > 0.0 { own.length() } else { along };
        let aside = own - over * keeps;
        let face = self.speed_on_face(finger, over, keeps.max(0.0), dt_s);
        let stroke = self.speed_within(self.stroke_left(-over), dt_s);
        let speed = wanted.min(self.limits.speed_m_per_s).min(face).min(stroke);
        let velocity = (aside - over * speed).clamp_length_max(self.limits.speed_m_per_s);
        let Change { reached, braked } = self.accelerate(velocity, dt_s);
        // Speed first, then orientation: together they would have to share the joints' capacity.
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

    /// The nearer of the two rolls at which a scan has the level's angle to the bumps, rad: both sides of the bumps feel the same. The board keeps
    /// turning to the same side until the other one is clearly nearer.
    fn nearer_roll(&mut self, scan_rad: f64, level: &Level) -> f64 {
        let [left, right] = [1.0, -1.0]
            .map(|side| nearest_half_turn(scan_rad + side * level.scan.rad(), self.roll_rad));
        let off = |roll_rad: f64| (self.roll_rad - roll_rad).abs();
        let lead_rad = match self.turns_left {
            true => SIDE_RAD,
            false => -SIDE_RAD,
        };
        self.turns_left = off(left) <= off(right) + lead_rad;
        if self.turns_left { left } else { right }
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

    /// Turns towards an angle `left_rad` away, within the limits.
    fn turn(&mut self, left_rad: f64, dt_s: f64) {
        let most = self.limits.turn_rad_per_s2 * dt_s;
        // The highest rate from which the turn can still stop after one more step.
        let stops =
            (most * most + 2.0 * self.limits.turn_rad_per_s2 * left_rad.abs()).sqrt() - most;
        let wanted = left_rad.signum() * stops.min(self.limits.turn_rad_per_s);
        let before = self.roll_rad_per_s;
        self.roll_rad_per_s += (wanted - before).clamp(-most, most);
        self.roll_rad += 0.5 * dt_s * (before + self.roll_rad_per_s);
    }

    /// Accelerates towards a velocity. If the board could then no longer stop within its stroke, it brakes
    /// instead, which is always possible.
    fn accelerate(&mut self, velocity_m_per_s: DVec2, dt_s: f64) -> Change {
        let (place, before) = (self.displacement_m, self.velocity_m_per_s);
        let mut braked = false;
        for wanted in [velocity_m_per_s, DVec2::ZERO] {
            let a = self.limits.acceleration_m_per_s2;
            let change = (wanted - before).clamp_length_max(a * dt_s);
            let after = before + change;
            // A small change ends before the step does.
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

    /// Highest speed from which the board can stop within a distance after one more step, m/s.
    fn speed_within(&self, left_m: f64, dt_s: f64) -> f64 {
        let a = self.limits.acceleration_m_per_s2;
        let step = a * dt_s;
        (step * step + 2.0 * a * left_m.max(0.0)).sqrt() - step
    }

    /// Highest speed from which the board can stop before a finger that crosses it along `scan` at `own_m_per_s` leaves the face, m/s.
    fn speed_on_face(&self, finger: &FingerState, scan: DVec2, own_m_per_s: f64, dt_s: f64) -> f64 {
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
        let own = own_m_per_s + a * dt_s;
        (own * own + 2.0 * a * left.max(0.0)).sqrt() - own
    }

    /// How far the board may still move along a direction, m.
    fn stroke_left(&self, along: DVec2) -> f64 {
        let at = self.displacement_m;
        // To the edge of the disc of the stroke.
        let radius = self.limits.stroke_m;
        let b = at.dot(along);
        let inside = b * b + radius * radius - at.length_squared();
        let disc = if inside > 0.0 { inside.sqrt() - b } else { 0.0 };
        // To the edge of the reachable strip across the expected scan.
        let rate = along.dot(self.stroke_axis);
        let place = at.dot(self.stroke_axis);
        let strip = if rate > ALIKE {
            (self.reachable.along_m - place) / rate
        } else if rate < -ALIKE {
            (place + self.reachable.against_m) / -rate
        } else {
            f64::INFINITY
        };
        disc.min(strip).max(0.0)
    }
}

/// Outcome of a step towards a velocity.
#[derive(Debug, Clone, Copy)]
struct Change {
    /// The velocity is reached.
    reached: bool,
    /// The board had to brake instead.
    braked: bool,
}

/// The angle modulo half a turn that is nearest to another one.
fn nearest_half_turn(angle_rad: f64, to_rad: f64) -> f64 {
    let turn = wrapped(2.0 * (angle_rad - to_rad)) / 2.0;
    to_rad + turn
}
