//! Pose of the virtual world around the arm.

use crate::error::SessionError;
use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_geometry::Pose;
use hwall_hand::HandState;

/// The pose of the virtual world at one time: an input like the hand.
///
/// A pose stays valid until the next one, so a static world needs none. While the world moves, send poses as often as frames: a frame is
/// interpreted in the newest pose, however old that pose is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldPose {
    /// Time on the clock of the tracker, s.
    pub t_s: f64,
    /// The frame of the scene in the base frame of the arm.
    pub base_from_world: Pose,
}

/// Smaller changes, measured at the base of the arm, are noise of a tracked origin: metres, radians.
const MOVED_M: f64 = 5e-4;
const MOVED_RAD: f64 = 1e-3;

/// A larger change in one update is a jump (teleport, snap turn), not a motion: metres and radians, plus what fast steering adds per
/// second, for at most a tenth of one.
const LEAP_M: f64 = 0.1;
const LEAP_RAD: f64 = 0.09;
const STEERING_PER_S: f64 = 3.0;
const STEERING_S: f64 = 0.1;

/// The world counts as moving for this long after its newest pose, s.
const MOVING_S: f64 = 0.1;

/// What a new pose of the world means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WorldChange {
    /// The world has not moved.
    None,
    /// The world moved.
    Moved,
    /// The world jumped: positions seen before are invalid.
    Leapt,
}

/// The current pose of the world.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct World {
    /// Stamp of the newest pose, used or not, s.
    newest_s: Option<f64>,
    base_from_world: Option<Pose>,
    motion: Option<Motion>,
    moves: u64,
    leaps: u64,
}

/// The last step of a world in motion.
#[derive(Debug, Clone, Copy)]
struct Motion {
    world_from_base_before: Pose,
    took_s: f64,
    until_s: f64,
}

impl World {
    /// Takes a new pose. A clock that was set back is rejected once and accepted from its new time on.
    pub(super) fn take(&mut self, pose: &WorldPose) -> Result<WorldChange, SessionError> {
        hwall_numeric::check::finite("t_s of the world", pose.t_s)?;
        let last_s = self.newest_s.replace(pose.t_s);
        if let Some(last_s) = last_s.filter(|last_s| pose.t_s < *last_s) {
            let by_s = last_s - pose.t_s;
            return Err(SessionError::WorldTimeReversed { by_s });
        }
        let before = self.base_from_world();
        // Compares the base in world coordinates: a turn about a far origin is a turn, not a jump.
        let (old, new) = (before.inverse(), pose.base_from_world.inverse());
        let moved = old.distance(&new);
        if moved.position_m <= MOVED_M && moved.angle_rad <= MOVED_RAD {
            return Ok(WorldChange::None);
        }
        self.base_from_world = Some(pose.base_from_world);
        self.moves += 1;
        let took_s = last_s.map_or(0.0, |last_s| pose.t_s - last_s);
        let steered = STEERING_PER_S * took_s.min(STEERING_S);
        if moved.position_m > LEAP_M + steered || moved.angle_rad > LEAP_RAD + steered {
            self.motion = None;
            self.leaps += 1;
            return Ok(WorldChange::Leapt);
        }
        self.motion = (took_s > 0.0).then_some(Motion {
            world_from_base_before: old,
            took_s,
            until_s: pose.t_s + MOVING_S,
        });
        Ok(WorldChange::Moved)
    }

    /// How many times the world moved by more than the noise of a tracker.
    pub(super) const fn moves(&self) -> u64 {
        self.moves
    }

    /// How many times it jumped.
    pub(super) const fn leaps(&self) -> u64 {
        self.leaps
    }

    /// `None` while the frames of world and base agree and nothing needs a transform.
    pub(super) fn world_from_base(&self) -> Option<Pose> {
        let pose = self.base_from_world();
        (pose != Pose::IDENTITY).then(|| pose.inverse())
    }

    /// The state of a tracked hand in the world: if the person is carried along in it, a resting hand moves, too.
    pub(super) fn hand_in_world(&self, hand: &HandState, world_from_base: &Pose) -> HandState {
        let mut there = hand.transformed(world_from_base);
        let Some(motion) = self.motion.filter(|motion| hand.t_s <= motion.until_s) else {
            return there;
        };
        let before_m = motion.world_from_base_before.transform_point(hand.point_m);
        let carried: DVec3 = (there.point_m - before_m) / motion.took_s;
        there.velocity_m_per_s += carried;
        // A hand at rest in the room has no direction of its own; it takes the direction in which it is carried.
        there.direction = match there.velocity_m_per_s.try_normalize() {
            Some(direction) if there.velocity_m_per_s.length() >= CARRIED_M_PER_S => {
                Some(direction)
            }
            _ => there.direction.filter(|_| carried == DVec3::ZERO),
        };
        there
    }

    pub(super) fn contact_in_base(&self, contact: ContactPrediction) -> ContactPrediction {
        let pose = self.base_from_world();
        match pose == Pose::IDENTITY {
            true => contact,
            false => contact.transformed(&pose),
        }
    }

    /// The frame of the scene in the base frame.
    pub(super) fn base_from_world(&self) -> Pose {
        self.base_from_world.unwrap_or(Pose::IDENTITY)
    }
}

/// Below this a carried hand counts as resting, m/s, as in the filter of the hand.
const CARRIED_M_PER_S: f64 = 0.05;
