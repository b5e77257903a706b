//! Joint angles that hold the face on the path of a moving object.

mod joints;

use super::face_slide::{FaceSlide, InFace};
use crate::error::HapticsError;
use crate::motion::Slide;
use crate::object::ObjectPath;
use glam::{DVec2, DVec3};
use hwall_geometry::{Pose, Twist};
use hwall_kinematics::{
    ArmKinematics, ArmScratch, BranchPolicy, JointPositions, KinematicsError, NearestConfig,
    Unreachable,
};
use hwall_numeric::check::{all_finite, finite, positive};
use std::sync::Arc;

/// A solution further than this from the last one is on another branch, rad.
const NEXT_RAD: f64 = 0.2;

/// Time constant with which the face catches up, s. It smooths the noise of wanted positions, not their motion.
const CATCHING_S: f64 = 0.005;
/// Share of the acceleration that catching up reserves for braking.
const BRAKING: f64 = 0.4;
/// The face comes to rest this far before the end of the arm's reach, rad or m.
const BEFORE_END: f64 = 1e-4;
/// Number of bisections when the end of the reach is first detected; then one in each step.
const HALVINGS: usize = 6;
/// An end further away than this many braking distances is dropped again.
const OUT_OF_SIGHT: f64 = 4.0;
/// A path whose component in the face exceeds this leads along it: a drawer that is pushed sideways does not slide there, unless it is held.
const ACROSS: f64 = 0.1;
/// An object counts as held after this time at rest, s: one that breaks away repeatedly does not.
const HELD_S: f64 = 0.1;
/// Following an object uses this share of the accelerations; braking may use all.
const BRAKED_SHARE: f64 = 0.9;
/// A slide that would have to be slower than this share of the wanted one counts as impossible.
const LEAST_SLIDE: f64 = 0.02;

/// Share of the acceleration with which the face brakes before a joint's limit: joint rates change along the path.
const BEFORE_LIMITS: f64 = 0.4;
/// Upper bound of any path, rad or m.
const FARTHEST: f64 = 1e3;

/// Moves the face along with an object: converts its position to joint angles, within the joint speeds.
#[derive(Debug, Clone)]
pub(in crate::render) struct PathFollower {
    arm: Arc<dyn ArmKinematics>,
    config: NearestConfig,
    scratch: ArmScratch,
    path: ObjectPath,
    /// The face where the touch began, base frame, and the object's position then.
    face: Pose,
    position: f64,
    /// Position of the face on the path, and its rate.
    reached: f64,
    rate: f64,
    /// The board's slide within the face, and the wanted one.
    slide: FaceSlide,
    wanted_slide: InFace,
    /// How long the object has been held, s.
    held_s: f64,
    /// The end of the reach ahead of the face, if detected.
    end: Option<EndOfReach>,
    max_acceleration_rad_per_s2: [f64; 7],
    q: JointPositions,
}

/// The end of the arm's reach on the path: between a reachable position and an unreachable one.
#[derive(Debug, Clone, Copy)]
struct EndOfReach {
    reachable: f64,
    beyond: f64,
    slide: FaceSlide,
    reason: Unreachable,
}

/// How far the face could follow.
#[derive(Debug, Clone, Copy)]
pub(in crate::render) struct Followed {
    /// Share of the requested motion, 0 to 1; less where the joints are too slow, 0 where they cannot hold the face.
    pub(in crate::render) share: f64,
    /// Share of the rate that `limited` allowed, 0 to 1.
    pub(in crate::render) allowed: f64,
    /// Rate of the face along the path now, rad/s or m/s.
    pub(in crate::render) rate: f64,
    /// Why the board cannot slide within the face, if so.
    pub(in crate::render) cannot_slide: Option<Unreachable>,
    /// Why it cannot follow at all, if so.
    pub(in crate::render) unreachable: Option<Unreachable>,
    /// Largest acceleration along the path here, rad/s² or m/s².
    pub(in crate::render) most_acceleration: f64,
}

impl PathFollower {
    /// The arm's tool is the face of the board.
    pub(in crate::render) fn new(
        arm: Arc<dyn ArmKinematics>,
        max_acceleration_rad_per_s2: [f64; 7],
    ) -> Self {
        let max_acceleration_rad_per_s2 = arm.accelerations_or(max_acceleration_rad_per_s2);
        // Slow joints turn less.
        let weights = arm.max_velocity_rad_per_s().map(|speed| speed.powi(-2));
        Self {
            config: NearestConfig {
                weights,
                policy: BranchPolicy::Keep,
                ..NearestConfig::default()
            },
            scratch: arm.scratch(),
            face: Pose::IDENTITY,
            path: ObjectPath::Sliding {
                direction: glam::DVec3::X,
            },
            position: 0.0,
            reached: 0.0,
            rate: 0.0,
            slide: FaceSlide::default(),
            wanted_slide: InFace::default(),
            held_s: 0.0,
            end: None,
            max_acceleration_rad_per_s2,
            q: JointPositions::default(),
            arm,
        }
    }

    /// Begins with a configuration that holds the face on an object at a position.
    ///
    /// # Errors
    /// NaN or infinity.
    pub(in crate::render) fn begin(
        &mut self,
        path: ObjectPath,
        position: f64,
        q: &JointPositions,
    ) -> Result<(), HapticsError> {
        all_finite("q", &q.0)?;
        self.face = self.arm.forward(q);
        (self.path, self.position, self.q) = (path, position, *q);
        (self.reached, self.rate) = (position, 0.0);
        (self.slide, self.wanted_slide) = (FaceSlide::default(), InFace::default());
        (self.held_s, self.end) = (0.0, None);
        Ok(())
    }

    /// The arm, with the face of the board as its tool.
    pub(in crate::render) const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// Joint angles of the last step, rad.
    pub(in crate::render) const fn q(&self) -> &JointPositions {
        &self.q
    }

    /// Pose of the face on the object at a position, including the slide.
    pub(in crate::render) fn face_at(&self, position: f64) -> Pose {
        let place = self.path.moved(&self.face, position - self.position);
        self.slide.on(&place)
    }

    /// Moves towards a position with a rate, as far as the joints allow: all slow down together, so that the face stays on the path. `limited`
    /// returns how much of a rate the joints allow may be used: no faster, and not in reverse.
    pub(in crate::render) fn follow(
        &mut self,
        (wanted, rate): (f64, f64),
        dt_s: f64,
        mut limited: impl FnMut(f64) -> Result<f64, HapticsError>,
    ) -> Result<Followed, HapticsError> {
        positive("dt_s", dt_s)?;
        finite("wanted", wanted)?;
        finite("rate", rate)?;
        self.spare_joints();
        let Some(rates) = self.joint_rates() else {
            // No joints move the face along here: the object stands.
            (self.rate, self.slide) = (0.0, self.slide.stopped());
            return Ok(Followed {
                share: 0.0,
                allowed: 1.0,
                rate: 0.0,
                cannot_slide: None,
                unreachable: Some(Unreachable::OtherBranch),
                most_acceleration: 0.0,
            });
        };
        let most = self.largest_acceleration(&rates);
        let free = self.next_rate(wanted, rate, most, dt_s);
        self.look_for_end(free, most)?;
        let room = self.left(&rates, free).min(self.before_end());
        let before_limits = (2.0 * BEFORE_LIMITS * most * room).sqrt().max(0.0);
        let allowed = limited(free.clamp(-before_limits, before_limits))?;
        // The allowed rate may drop at once; a moving board needs time.
        let least = if self.rate * free > 0.0 {
            self.rate.abs() - most / BRAKED_SHARE * dt_s
        } else {
            0.0
        };
        let size = allowed.abs().max(least).min(free.abs());
        let rate = size.copysign(free);
        let aimed = self.reached + rate * dt_s;
        let mut followed = Followed {
            share: 1.0,
            allowed: if free == 0.0 {
                1.0
            } else {
                (rate / free).clamp(0.0, 1.0)
            },
            rate: 0.0,
            unreachable: self.end.filter(|_| rate == 0.0).map(|end| end.reason),
            most_acceleration: most,
            cannot_slide: None,
        };
        // The object has priority: a slide comes to rest if the joints lack range or speed for it.
        let share = self.slide_share(&rates, rate);
        let share = if share < LEAST_SLIDE {
            followed.cannot_slide = Some(Unreachable::OtherBranch);
            0.0
        } else {
            share
        };
        let mut slide = self.slide.next(self.wanted_slide.times(share), dt_s);
        for next in [
            self.slide.next(InFace::default(), dt_s),
            self.slide.stopped(),
        ] {
            if !slide.is_moving() {
                break;
            }
            let hindered = match self.solved(aimed, &slide)? {
                Ok(q) if self.excess(&q, dt_s) <= 1.0 => break,
                Ok(_) => Unreachable::OtherBranch,
                Err(reason) => reason,
            };
            followed.cannot_slide = Some(hindered);
            slide = next;
        }
        let mut held = |follower: &mut Self, reason| {
            (follower.rate, follower.slide) = (0.0, follower.slide.stopped());
            (followed.share, followed.unreachable) = (0.0, Some(reason));
            Ok(followed)
        };
        let mut q = match self.solved(aimed, &slide)? {
            Ok(q) => q,
            Err(reason) => return held(self, reason),
        };
        let excess = self.excess(&q, dt_s);
        let mut reached = aimed;
        if excess > 1.0 {
            // Nearly straight over one period.
            reached = self.reached + (aimed - self.reached) / excess;
            q = match self.solved(reached, &slide)? {
                Ok(q) => q,
                Err(reason) => return held(self, reason),
            };
        }
        followed.share = 1.0 / excess;
        self.rate = (reached - self.reached) / dt_s;
        followed.rate = self.rate;
        (self.q, self.reached, self.slide) = (q, reached, slide);
        Ok(followed)
    }

    /// Next rate of the face, within the joint accelerations. It catches up with the wanted position at a speed that can still be braked.
    fn next_rate(&self, wanted: f64, rate: f64, most: f64, dt_s: f64) -> f64 {
        let missing = wanted - (self.reached + rate * dt_s);
        let closing = (missing.abs() / CATCHING_S.max(dt_s))
            .min((BRAKING * 2.0 * most * missing.abs()).sqrt())
            .copysign(missing);
        (rate + closing).clamp(self.rate - most * dt_s, self.rate + most * dt_s)
    }

    /// Is the object held, by a stop or by friction, during the coming step? Once it has been held for a while, the board also slides along its path.
    pub(in crate::render) fn hold(&mut self, held: bool, dt_s: f64) {
        self.held_s = if held { self.held_s + dt_s } else { 0.0 };
    }

    /// The face on the path, without its slide.
    fn place(&self) -> Pose {
        self.path.moved(&self.face, self.reached - self.position)
    }

    /// Component of the slide along the object's path, rad or m: it is no motion of the object.
    pub(in crate::render) fn slid_along(&self) -> f64 {
        let place = self.place();
        self.path.way_between(&place, &self.slide.on(&place))
    }

    /// Sets the slide within the face. The component along the normal is dropped; so is the component along the object's path, where the hand feels
    /// the object itself, unless the object is held.
    pub(in crate::render) fn set_slide(&mut self, slide: &Slide) {
        let place = self.place();
        let local = |v: DVec3| place.rotation().transpose() * v;
        let velocity = local(slide.velocity_m_per_s).truncate();
        let way = self.path.velocity_at(place.position_m(), 1.0);
        let way = local(way.linear_m_per_s.normalize_or_zero()).truncate();
        let along = match way.length() > ACROSS && self.held_s < HELD_S {
            true => velocity.project_onto(way),
            false => DVec2::ZERO,
        };
        self.wanted_slide = InFace {
            linear: velocity - along,
            angular: slide.turn_rad_per_s,
        };
    }

    /// Velocity of the slide, base axes, and the joint velocities for it, rad/s.
    ///
    /// Zero if no joints can slide the board.
    pub(in crate::render) fn slide_motion(&self) -> (Twist, [f64; 7]) {
        let place = self.place();
        let twist = self.slide.twist(&place);
        let found = self.slide.is_moving().then(|| self.rates_for(&twist));
        match found.flatten() {
            Some(rates) => (twist, rates),
            None => (Twist::default(), [0.0; 7]),
        }
    }

    /// Searches for the end of the reach if the face would be beyond it once its joints had braked: near a straight arm joints turn ever faster for
    /// the same motion, and would have to stop at once.
    fn look_for_end(&mut self, free: f64, most: f64) -> Result<(), HapticsError> {
        let stop = BEFORE_END + self.rate * self.rate / (2.0 * BEFORE_LIMITS * most);
        if free == 0.0 || self.rate * free < 0.0 || !stop.is_finite() {
            self.end = None;
            return Ok(());
        }
        let far = OUT_OF_SIGHT * (stop + BEFORE_END);
        let (slide, reached) = (self.slide, self.reached);
        let ahead = |position: f64| (position - reached) * free.signum();
        let in_sight = |end: &EndOfReach| {
            end.slide == slide && ahead(end.reachable) >= 0.0 && ahead(end.beyond) <= far
        };
        let mut halvings = 1;
        let mut end = match self.end.filter(in_sight) {
            Some(end) => end,
            None => {
                halvings = HALVINGS;
                let beyond = self.reached + stop.copysign(free);
                let Some(reason) = self.no_reach_at(beyond)? else {
                    self.end = None;
                    return Ok(());
                };
                EndOfReach {
                    reachable: self.reached,
                    beyond,
                    slide,
                    reason,
                }
            }
        };
        for _ in 0..halvings {
            let middle = 0.5 * (end.reachable + end.beyond);
            match self.no_reach_at(middle)? {
                None => end.reachable = middle,
                Some(reason) => (end.beyond, end.reason) = (middle, reason),
            }
        }
        self.end = Some(end);
        Ok(())
    }

    /// Distance of the face from the end of the reach, rad or m.
    fn before_end(&self) -> f64 {
        match self.end {
            Some(end) => ((end.reachable - self.reached).abs() - BEFORE_END).max(0.0),
            None => FARTHEST,
        }
    }

    /// Why no joints hold the face at a position, if so.
    fn no_reach_at(&mut self, position: f64) -> Result<Option<Unreachable>, HapticsError> {
        let slide = self.slide;
        Ok(self.nearest_at(position, &slide)?.err())
    }

    /// Position of the face on the path: that of the object after the last step.
    pub(in crate::render) const fn reached(&self) -> f64 {
        self.reached
    }

    /// Commanded motion of the face since the touch began, rad or m.
    pub(in crate::render) fn commanded_way(&self) -> f64 {
        self.reached - self.position
    }

    /// Moves to a nearby position on the path. Returns why the face cannot be there, if so; the joints then stay.
    ///
    /// # Errors
    /// NaN or infinity.
    pub(in crate::render) fn go_to(
        &mut self,
        position: f64,
    ) -> Result<Option<Unreachable>, HapticsError> {
        let slide = self.slide;
        Ok(match self.solved(position, &slide)? {
            Ok(q) => {
                (self.q, self.reached) = (q, position);
                None
            }
            Err(reason) => Some(reason),
        })
    }

    /// Joint angles for a position within a step, or why there are none.
    fn solved(
        &mut self,
        position: f64,
        slide: &FaceSlide,
    ) -> Result<Result<JointPositions, Unreachable>, HapticsError> {
        Ok(match self.nearest_at(position, slide)? {
            Ok(q) if q.max_abs_difference(&self.q) > NEXT_RAD => Err(Unreachable::OtherBranch),
            found => found,
        })
    }

    fn nearest_at(
        &mut self,
        position: f64,
        slide: &FaceSlide,
    ) -> Result<Result<JointPositions, Unreachable>, HapticsError> {
        let face = slide.on(&self.path.moved(&self.face, position - self.position));
        match self
            .arm
            .nearest(&face, &self.q, &self.config, &mut self.scratch)
        {
            Ok(found) => Ok(Ok(found.q)),
            Err(KinematicsError::Unreachable(reason)) => Ok(Err(reason)),
            Err(other) => Err(other.into()),
        }
    }
}

#[cfg(test)]
mod tests;
