//! Self-motion of the redundant arm, and dexterity.

use crate::joints::{JointPositions, JointVelocities};
use crate::linalg::null_vector;
use crate::srs::forward::Frames;
use crate::srs::model::SrsArm;

/// How well a configuration can move the tool.
///
/// Rotations are weighted by a length, to make metres and radians comparable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dexterity {
    /// Yoshikawa's measure, the product of the singular values of the weighted Jacobian, m⁶.
    pub manipulability: f64,
    /// Singular values of the weighted Jacobian, descending, m.
    pub singular_values_m: [f64; 6],
}

/// How near a configuration is to the joint limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestLimit {
    /// The joint that is nearest to one of its limits, from 0.
    pub joint: usize,
    /// Distance of that joint to the limit, rad; negative outside.
    pub distance_rad: f64,
}

impl Dexterity {
    /// Smallest over largest singular value: 0 at a singularity, 1 for an arm that moves
    /// equally well in all directions.
    #[must_use]
    pub fn isotropy(&self) -> f64 {
        self.singular_values_m[5] / self.singular_values_m[0]
    }
}

impl SrsArm {
    /// Unit joint velocity that keeps the tool at rest: the elbow rotates about the line from
    /// shoulder to wrist with increasing arm angle.
    ///
    /// At a singularity there are several such motions; returns one of them. NaN in gives NaN out.
    /// Error: it moves the tool by less than 1e-13 m/s and rad/s per rad/s (tests/it/srs_properties.rs).
    #[must_use]
    pub fn self_motion(&self, q: &JointPositions) -> JointVelocities {
        let mut motion = JointVelocities(null_vector(self.jacobian(q).to_rows()));
        // Increasing: the elbow's velocity has a positive component along (u × elbow).
        let [shoulder, elbow, wrist, _] = self.skeleton_m(q);
        let frames = Frames::new(q);
        let arm = elbow - shoulder;
        let velocity = (glam::DVec3::Z * motion[0] + frames.y1 * motion[1]).cross(arm);
        if (wrist - shoulder).cross(arm).dot(velocity) < 0.0 {
            motion.0 = motion.0.map(|v| -v);
        }
        motion
    }

    /// The part of a joint velocity that does not move the tool.
    #[must_use]
    pub fn null_space_part(
        &self,
        q: &JointPositions,
        velocity: &JointVelocities,
    ) -> JointVelocities {
        let n = self.self_motion(q);
        let along: f64 = n.0.iter().zip(velocity.0).map(|(a, b)| a * b).sum();
        JointVelocities(n.0.map(|x| x * along))
    }

    /// Singular values of the Jacobian, rotations weighted by `rotation_length_m`: 1 rad counts
    /// as that many metres (a board's half width is a good choice).
    #[must_use]
    pub fn dexterity(&self, q: &JointPositions, rotation_length_m: f64) -> Dexterity {
        let singular_values_m = self.jacobian(q).singular_values(rotation_length_m);
        Dexterity {
            manipulability: singular_values_m.iter().product(),
            singular_values_m,
        }
    }

    /// The joint that is nearest to one of its limits.
    #[must_use]
    pub fn nearest_limit(&self, q: &JointPositions) -> NearestLimit {
        let limits = self.limits().iter().zip(q.0).enumerate();
        limits
            .map(|(joint, (limit, q))| NearestLimit {
                joint,
                distance_rad: limit.distance_rad(q),
            })
            .min_by(|a, b| a.distance_rad.total_cmp(&b.distance_rad))
            .expect("seven joints")
    }
}
