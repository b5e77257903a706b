//! Where the virtual world stands around the arm.

use crate::error::SessionError;
use glam::DMat3;
use hwall_contact::ContactPrediction;
use hwall_geometry::Pose;

/// The place of the virtual world at one time: an input like the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldPose {
    /// Time on the clock of the tracker, s.
    pub t_s: f64,
    /// The frame of the scene in the base frame of the arm.
    pub base_from_world: Pose,
}

/// Smaller changes than these are noise of a tracked origin: metres, radians.
const MOVED_M: f64 = 5e-4;
const MOVED_RAD: f64 = 1e-3;

/// The newest place of the world.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct World {
    newest: Option<WorldPose>,
    /// The place from which the next change is counted.
    counted: Option<Pose>,
    moves: u64,
}

impl World {
    /// Takes a new place; was it another one? A clock that was set back is refused once and counts from its new time on.
    pub(super) fn moved(&mut self, pose: &WorldPose) -> Result<bool, SessionError> {
        hwall_numeric::check::finite("t_s of the world", pose.t_s)?;
        if let Some(last) = self.newest.as_mut().filter(|last| pose.t_s < last.t_s) {
            let by_s = last.t_s - pose.t_s;
            last.t_s = pose.t_s;
            return Err(SessionError::WorldTimeReversed { by_s });
        }
        let before = self.base_from_world();
        self.newest = Some(*pose);
        let moved = self
            .counted
            .unwrap_or(Pose::IDENTITY)
            .distance(&pose.base_from_world);
        if moved.position_m > MOVED_M || moved.angle_rad > MOVED_RAD {
            self.counted = Some(pose.base_from_world);
            self.moves += 1;
        }
        Ok(before != pose.base_from_world)
    }

    /// How often the world was moved by more than the noise of a tracker.
    pub(super) const fn moves(&self) -> u64 {
        self.moves
    }

    /// `None` while the frames of world and base agree, so that nothing need be transformed.
    pub(super) fn world_from_base(&self) -> Option<Pose> {
        let pose = self.base_from_world();
        (pose != Pose::IDENTITY).then(|| pose.inverse())
    }

    pub(super) fn contact_in_base(&self, contact: ContactPrediction) -> ContactPrediction {
        let pose = self.base_from_world();
        if pose == Pose::IDENTITY {
            return contact;
        }
        let r: DMat3 = pose.rotation();
        ContactPrediction {
            point_m: pose.transform_point(contact.point_m),
            normal: pose.transform_vector(contact.normal),
            covariance_m2: contact.covariance_m2.map(|c| r * c * r.transpose()),
            ..contact
        }
    }

    fn base_from_world(&self) -> Pose {
        self.newest.map_or(Pose::IDENTITY, |w| w.base_from_world)
    }
}
