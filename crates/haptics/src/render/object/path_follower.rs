//! The joints that hold the face on the path of a moving object.

use super::face_slide::{FaceSlide, InFace, MOST_M_PER_S2};
use crate::error::HapticsError;
use crate::motion::Slide;
use crate::object::ObjectPath;
use glam::{DVec2, DVec3};
use hwall_geometry::{Pose, Twist};
use hwall_kinematics::{
    ArmKinematics, ArmScratch, BranchPolicy, JointPositions, JointVelocities, KinematicsError,
    NearestConfig, Unreachable,
};
use hwall_numeric::check::{all_finite, finite, positive};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};
use std::sync::Arc;

/// Share of the joint speeds that following an object may use.
const SPEED_SHARE: f64 = 0.95;
/// A solution further than this from the last one belongs to another family of configurations, rad.
const NEXT_RAD: f64 = 0.2;

/// Time in which the face catches up with what is missing, s. It smooths the noise of wanted positions, not their motion.
const CATCHING_S: f64 = 0.005;
/// Share of the acceleration that catching up counts upon to brake with.
const BRAKING: f64 = 0.4;
/// Share of the acceleration with which the face brakes before a joint's limit: rates of joints change on the way.
const BEFORE_LIMITS: f64 = 0.4;
/// The face comes to rest so far before the end of the arm's reach, rad or m.
const BEFORE_END: f64 = 1e-4;
/// So many halvings say where the end of the reach is when it comes in sight; then one in each step.
const HALVINGS: usize = 6;
/// An end further away than this many ways to brake is out of sight again.
const OUT_OF_SIGHT: f64 = 4.0;
/// A path whose share in the face is larger than this leads along it: a drawer that is pushed sideways does not slide there, unless it
/// is held.
const ACROSS: f64 = 0.1;
/// An object counts as held after this time at rest, s: one that breaks away again and again is not.
const HELD_S: f64 = 0.1;
/// No path is longer, rad or m.
const FARTHEST: f64 = 1e3;
/// Joints nearer than this to a limit turn less, rad; on the limit so many times less, about.
const SPARED_RAD: f64 = 0.6;
const SPARED: f64 = 40.0;
/// Share of the accelerations that following an object leaves to braking.
const BRAKED_SHARE: f64 = 0.9;
/// A joint that a slide turns no faster than this is not stopped for it, rad/s.
const IDLE_RAD_PER_S: f64 = 1e-3;
/// A slide comes no nearer than this to a joint's limit, rad: the object under it needs room, too, and an arm under torques that is
/// late must not run into its stop, which it could not tell from a hand. As wide as the margin of [`JointGuard`](crate::render::JointGuard).
const KEPT_RAD: f64 = 0.2;
/// A slide that has to be slower than this share of what is wanted counts as one that cannot be.
const LEAST_SLIDE: f64 = 0.02;
/// Keeps joint rates finite near singular poses; m² rad²/s².
const DAMPING: f64 = 1e-6;
/// Rates that miss more than this share of a motion of the face do not make it.
const MISSING: f64 = 0.5;

/// Carries the face along with an object: from its position to joint angles, within the speeds of the joints.
#[derive(Debug, Clone)]
pub(in crate::render) struct PathFollower {
    arm: Arc<dyn ArmKinematics>,
    config: NearestConfig,
    scratch: ArmScratch,
    path: ObjectPath,
    /// The face where the touch began, base frame, and the object's position then.
    face: Pose,
    position: f64,
    /// Where the face is on the path, and how fast it goes there.
    reached: f64,
    rate: f64,
    /// How far the board has slid within the face, and how it shall.
    slide: FaceSlide,
    wanted_slide: InFace,
    /// For so long the object has been held, s.
    held_s: f64,
    /// The end of the arm's reach that the face goes towards, if it is in sight.
    end: Option<EndOfReach>,
    max_acceleration_rad_per_s2: [f64; 7],
    q: JointPositions,
}

/// Where on the path the arm's reach ends: between a position that it reaches and one that it does not.
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
    /// Share of the way asked for, 0 to 1; less where the joints are too slow, 0 where they cannot hold the face.
    pub(in crate::render) share: f64,
    /// Share of the rate that `limited` let through, 0 to 1.
    pub(in crate::render) allowed: f64,
    /// How fast the face goes along the path now, rad/s or m/s.
    pub(in crate::render) rate: f64,
    /// Why the board cannot slide within the face, if so.
    pub(in crate::render) cannot_slide: Option<Unreachable>,
    /// Why not at all.
    pub(in crate::render) unreachable: Option<Unreachable>,
    /// Largest acceleration along the path here, rad/s² or m/s².
    pub(in crate::render) most_acceleration: f64,
}

impl PathFollower {
    /// The tool of the arm is the face of the board.
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

    /// Begins with joints that hold the face on an object at a position.
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

    /// Pose of the face on the object at a position, slid as far as it has.
    pub(in crate::render) fn face_at(&self, position: f64) -> Pose {
        let place = self.path.moved(&self.face, position - self.position);
        self.slide.on(&place)
    }

    /// Goes on to a position that moves at a rate, or as far towards it as the joints allow: all slow down together, so that the face
    /// stays on the path. `limited` says how fast it may go of a rate that the joints allow: no faster, and not the other way.
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
            // No joints take the face along here: the object stands.
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
        // What is allowed may be less at once; a board that moves takes its time.
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
        // The object goes first: a slide that the joints have no room or speed for comes to rest.
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

    /// A joint near its limit turns less than the others, as far as the arm has a choice: an object goes on opening where it
    /// would be stopped by a single joint.
    fn spare_joints(&mut self) {
        let speeds = self.arm.max_velocity_rad_per_s();
        let limits = self.arm.limits();
        for (i, weight) in self.config.weights.iter_mut().enumerate() {
            let room = (limits[i].max_rad - self.q[i]).min(self.q[i] - limits[i].min_rad);
            let near = (1.0 - room.max(0.0) / SPARED_RAD).max(0.0);
            *weight = speeds[i].powi(-2) * (1.0 + SPARED * near * near);
        }
    }

    /// How fast the face goes on, within the accelerations of the joints. What is missing to the wanted position is caught up
    /// with, at a speed that can still be braked.
    fn next_rate(&self, wanted: f64, rate: f64, most: f64, dt_s: f64) -> f64 {
        let missing = wanted - (self.reached + rate * dt_s);
        let closing = (missing.abs() / CATCHING_S.max(dt_s))
            .min((BRAKING * 2.0 * most * missing.abs()).sqrt())
            .copysign(missing);
        (rate + closing).clamp(self.rate - most * dt_s, self.rate + most * dt_s)
    }

    /// How many times too fast the joints would have to be.
    fn excess(&self, q: &JointPositions, dt_s: f64) -> f64 {
        let speeds = self.arm.max_velocity_rad_per_s();
        (0..self.arm.joint_count())
            .map(|i| (q[i] - self.q[i]).abs() / (SPEED_SHARE * speeds[i] * dt_s))
            .fold(1.0, f64::max)
    }

    /// Is the object held, by a stop or by friction, in the step of this length that comes? Once it has been for a while, the board slides
    /// along its path, too.
    pub(in crate::render) fn hold(&mut self, held: bool, dt_s: f64) {
        self.held_s = if held { self.held_s + dt_s } else { 0.0 };
    }

    /// How far the slide takes the face along the path of the object, rad or m: that is no motion of the object.
    pub(in crate::render) fn slid_along(&self) -> f64 {
        let place = self.path.moved(&self.face, self.reached - self.position);
        self.path.way_between(&place, &self.slide.on(&place))
    }

    /// How the board slides within the face from now on. What points along the normal is left out; so is what points along the path of the
    /// object, in which the hand feels the object itself, unless the object is held.
    pub(in crate::render) fn set_slide(&mut self, slide: &Slide) {
        let place = self.path.moved(&self.face, self.reached - self.position);
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

    /// How the board slides now, base axes, and the joint velocities for that, rad/s.
    ///
    /// A board that no joints can slide stands.
    pub(in crate::render) fn slide_motion(&self) -> (Twist, [f64; 7]) {
        let place = self.path.moved(&self.face, self.reached - self.position);
        let twist = self.slide.twist(&place);
        let found = self.slide.is_moving().then(|| self.rates_for(&twist));
        match found.flatten() {
            Some(rates) => (twist, rates),
            None => (Twist::default(), [0.0; 7]),
        }
    }

    /// Share of the wanted slide from which every joint can still brake before its limit, while the object takes the face along its path
    /// at a rate; 0 where no joints slide it.
    fn slide_share(&self, rates: &[f64; 7], rate: f64) -> f64 {
        let size = self.wanted_slide.size();
        if size == 0.0 {
            return 1.0;
        }
        let place = self.path.moved(&self.face, self.reached - self.position);
        let Some(wanted) = self.rates_for(&self.wanted_slide.twist(&self.slide.on(&place))) else {
            return 0.0;
        };
        let limits = self.arm.limits();
        let share = |i: usize| {
            let towards = wanted[i].signum();
            let room = match towards > 0.0 {
                true => limits[i].max_rad - self.q[i],
                false => self.q[i] - limits[i].min_rad,
            };
            // From this speed a joint comes to rest that brakes at a rate.
            let room = (room - KEPT_RAD).max(0.0);
            let most = |braking: f64| (2.0 * BEFORE_LIMITS * braking * room).sqrt();
            let alone = most(wanted[i].abs() / size * MOST_M_PER_S2);
            let taken = (rates[i] * rate * towards).max(0.0);
            let left = (most(self.max_acceleration_rad_per_s2[i]) - taken).max(0.0);
            alone.min(left) / wanted[i].abs()
        };
        (0..self.arm.joint_count())
            .filter(|i| wanted[*i].abs() > IDLE_RAD_PER_S)
            .map(share)
            .fold(1.0, f64::min)
    }

    /// How far the face can go in the direction of a rate before a joint meets its limit, rad or m: as if the joints went on
    /// turning as they do.
    fn left(&self, rates: &[f64; 7], rate: f64) -> f64 {
        let limits = self.arm.limits();
        let left = |i: usize| {
            let towards = rates[i] * rate.signum();
            let room = match towards > 0.0 {
                true => limits[i].max_rad - self.q[i],
                false => self.q[i] - limits[i].min_rad,
            };
            room.max(0.0) / towards.abs()
        };
        (0..self.arm.joint_count())
            .filter(|i| rates[*i] != 0.0)
            .map(left)
            .fold(FARTHEST, f64::min)
    }

    /// Fixations where the reach ends, if the face would be beyond its end once its joints had braked: where the arm is straight, joints turn
    /// ever faster for the same motion, and would have to stop at once.
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

    /// Room of the face before the end of the reach, rad or m.
    fn before_end(&self) -> f64 {
        match self.end {
            Some(end) => ((end.reachable - self.reached).abs() - BEFORE_END).max(0.0),
            None => FARTHEST,
        }
    }

    /// Why no joints hold the face at a position, if none do.
    fn no_reach_at(&mut self, position: f64) -> Result<Option<Unreachable>, HapticsError> {
        let slide = self.slide;
        Ok(self.nearest_at(position, &slide)?.err())
    }

    /// Along the path, rad/s² or m/s².
    fn largest_acceleration(&self, rates: &[f64; 7]) -> f64 {
        rates
            .iter()
            .zip(self.max_acceleration_rad_per_s2)
            .filter(|(rate, _)| **rate != 0.0)
            .map(|(rate, most)| most / rate.abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// Where the face is on the path: position of the object as of the last step.
    pub(in crate::render) const fn reached(&self) -> f64 {
        self.reached
    }

    /// Change of the joint angles with the position, rad for each rad or m: the least that moves the face along its path, joints
    /// weighted as in [`follow`](Self::follow). `None` where the arm is singular.
    pub(in crate::render) fn joint_rates(&self) -> Option<[f64; 7]> {
        let at_m = self.face_at(self.reached).position_m();
        self.rates_for(&self.path.velocity_at(at_m, 1.0))
    }

    /// Rates of the joints for a motion of the face; `None` where none make it, or it is not finite.
    fn rates_for(&self, twist: &Twist) -> Option<[f64; 7]> {
        let joints = self.arm.joint_count();
        let jacobian = self.arm.jacobian(&self.q);
        let wanted = twist.to_array();
        let row = |k: usize, i: usize| {
            if k < 3 {
                jacobian.linear[i][k]
            } else {
                jacobian.angular[i][k - 3]
            }
        };
        let weights = &self.config.weights;
        let mut square = [0.0; 36];
        for a in 0..6 {
            for b in 0..=a {
                square[6 * a + b] = (0..joints)
                    .map(|i| row(a, i) * row(b, i) / weights[i])
                    .sum();
            }
            square[7 * a] += DAMPING;
        }
        cholesky_in_place(6, &mut square).ok()?;
        let mut forces = wanted;
        solve_lower(&square, &mut forces);
        solve_lower_transposed(&square, &mut forces);
        let rates: [f64; 7] = std::array::from_fn(|i| {
            if i >= joints {
                return 0.0;
            }
            let pull: f64 = (0..6).map(|k| row(k, i) * forces[k]).sum();
            pull / weights[i]
        });
        // The damping leaves out what no joints can do.
        let made = jacobian.twist(&JointVelocities(rates)).to_array();
        let size = |v: &[f64; 6]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let missing: [f64; 6] = std::array::from_fn(|k| wanted[k] - made[k]);
        (size(&missing) <= MISSING * size(&wanted)).then_some(rates)
    }

    /// Goes to a position on the path, which is near; why the face cannot be there, if so. The joints then stay.
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

    /// Joints for a position that the face can go to in a step, or why there are none.
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
mod tests {
    use super::*;
    use hwall_kinematics::SrsArm;

    fn follower(deg: [f64; 7]) -> PathFollower {
        let arm = Arc::new(SrsArm::iiwa7());
        let most = hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2;
        let mut follower = PathFollower::new(arm, most);
        let path = ObjectPath::sliding(DVec3::X).unwrap();
        let q = JointPositions::from_deg(deg);
        follower.begin(path, 0.0, &q).unwrap();
        follower
    }

    const BENT: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

    #[test]
    fn where_no_joints_slide_the_board_its_share_is_zero() {
        let slide = InFace {
            linear: DVec2::X * 0.1,
            angular: 0.0,
        };
        let mut bent = follower(BENT);
        bent.wanted_slide = slide;
        let rates = bent.joint_rates().expect("away from singular poses");
        assert!(bent.slide_share(&rates, 0.0) > 0.0);
        // NaN never comes out as a share.
        bent.wanted_slide.linear.x = f64::NAN;
        assert_eq!(bent.slide_share(&rates, 0.0), 0.0);
        bent.wanted_slide = slide;
        bent.q[1] = f64::NAN;
        assert_eq!(bent.slide_share(&rates, 0.0), 0.0);
        assert_eq!(bent.joint_rates(), None);
    }

    #[test]
    fn a_straight_arm_cannot_go_on_and_says_so() {
        // Straight up: no joint lifts the face.
        let mut straight = follower([0.0; 7]);
        let path = ObjectPath::sliding(DVec3::Z).unwrap();
        straight
            .begin(path, 0.0, &JointPositions::default())
            .unwrap();
        assert_eq!(straight.joint_rates(), None);
        let followed = straight.follow((0.01, 0.1), 1e-3, Ok).unwrap();
        assert_eq!((followed.share, followed.rate), (0.0, 0.0));
        assert!(followed.unreachable.is_some() && followed.most_acceleration == 0.0);
    }

    #[test]
    fn where_the_reach_ends_no_joint_stops_at_once() {
        const DT_S: f64 = 1e-3;
        for speed in [0.1, 0.3, 0.6] {
            let mut arm = follower(BENT);
            let (mut before, mut last, mut hardest) = (arm.q, [0.0; 7], 0.0_f64);
            let (mut braked, mut again) = (false, 0.0_f64);
            for k in 1..4000 {
                let (wanted, rate) = (speed * DT_S * f64::from(k), arm.rate);
                arm.follow((wanted, speed), DT_S, Ok).unwrap();
                braked |= arm.rate < rate && arm.reached() > 0.1;
                if braked {
                    again = again.max(arm.rate - rate);
                }
                for i in 0..7 {
                    let rate = (arm.q[i] - before[i]) / DT_S;
                    let change = (rate - last[i]).abs() / DT_S;
                    hardest = hardest.max(change / arm.max_acceleration_rad_per_s2[i]);
                    last[i] = rate;
                }
                before = arm.q;
            }
            println!(
                "{speed} m/s: {hardest:.2} times the acceleration, {:.3} m, faster again by {again:.2e} m/s",
                arm.reached()
            );
            assert!(arm.rate.abs() < 1e-3, "{}", arm.rate);
            assert!(hardest < 2.0, "{speed} m/s: {hardest}");
            assert!(again < 1e-4, "{speed} m/s: {again}");
        }
    }

    #[test]
    fn positions_that_are_not_finite_are_refused_and_move_nothing() {
        let mut bent = follower(BENT);
        let before = *bent.q();
        for wanted in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0)] {
            assert!(bent.follow(wanted, 1e-3, Ok).is_err(), "{wanted:?}");
            assert_eq!(*bent.q(), before);
        }
    }
}
