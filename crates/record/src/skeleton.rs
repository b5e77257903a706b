//! The arm as drawn: frames of its links, and capsules along them.

use crate::error::RecordError;
use glam::{DMat3, DVec3};
use hwall::geometry::Pose;
use hwall::haptics::Board;
use hwall::kinematics::{ArmKinematics, Chain, ChainJoint, JointKind, MOST_JOINTS};

/// The arm's base, and the root frame.
pub(crate) const BASE: &str = "base";
/// The middle of the board's face.
pub(crate) const BOARD: &str = "board";
/// The frame of the scene.
pub(crate) const WORLD: &str = "world";

/// Radius of the first link's capsule, m, and its decrease from link to link, m.
const RADIUS_M: f64 = 0.068;
const THINNER_M: f64 = 0.004;
/// Links shorter than this are drawn as a sphere, m.
const SHORT_M: f64 = 0.005;
/// Chain and kinematics must agree within this, m: descriptions have five digits.
const AGREES_M: f64 = 1e-4;

/// A capsule in the frame of its link: all points closer to a segment than a radius, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Capsule {
    pub(crate) from_m: DVec3,
    pub(crate) to_m: DVec3,
    pub(crate) radius_m: f64,
}

impl Capsule {
    /// Length of the segment, m.
    pub(crate) fn length_m(&self) -> f64 {
        self.from_m.distance(self.to_m)
    }

    /// Middle of the segment, with z along it; `None` for a sphere.
    pub(crate) fn link_from_cylinder(&self) -> Option<Pose> {
        let along = self.to_m - self.from_m;
        if along.length() < SHORT_M {
            return None;
        }
        let z = along.normalize();
        let (x, y) = z.any_orthonormal_pair();
        let middle_m = 0.5 * (self.from_m + self.to_m);
        Pose::new(DMat3::from_cols(x, y, z), middle_m).ok()
    }
}

/// The frames and capsules of an arm, from its chain of joints. Frames are named `base`, `link_1` and so on, and `board` for the middle of
/// the board's face, both in transforms and in the URDF.
#[derive(Debug, Clone)]
pub struct Skeleton {
    pub(crate) joints: Vec<ChainJoint>,
    /// Names of the links that the joints move.
    pub(crate) links: Vec<String>,
    pub(crate) last_link_from_board: Pose,
    pub(crate) board: Board,
}

impl Skeleton {
    /// From a chain of joints and the kinematics of the session, whose tool is the face of the board.
    ///
    /// # Errors
    /// No joint or more than seven; a chain that does not end where the kinematics does.
    pub fn new(chain: &Chain, arm: &dyn ArmKinematics, board: &Board) -> Result<Self, RecordError> {
        let joints = chain.joints().to_vec();
        let count = joints.len();
        if count == 0 || count > MOST_JOINTS || count != arm.joint_count() {
            return Err(RecordError::JointCount { joints: count });
        }
        let zero = [0.0; MOST_JOINTS];
        let poses = chain.link_poses(&zero[..count])?;
        let board_at_zero = arm.forward(&hwall::kinematics::JointPositions(zero));
        // The last pose is that of the tip.
        let last = poses.get(count - 1).copied().unwrap_or(Pose::IDENTITY);
        let last_link_from_board = last.inverse() * board_at_zero;
        let skeleton = Self {
            links: (1..=count).map(|number| format!("link_{number}")).collect(),
            joints,
            last_link_from_board,
            board: *board,
        };
        skeleton.agrees(arm)?;
        Ok(skeleton)
    }

    /// Arms that agree at zero are the same only if all axes agree.
    fn agrees(&self, arm: &dyn ArmKinematics) -> Result<(), RecordError> {
        let mut q = [0.0; MOST_JOINTS];
        for (i, (angle, limit)) in q.iter_mut().zip(arm.limits()).enumerate() {
            *angle = (0.3 + 0.1 * i as f64).clamp(limit.min_rad, limit.max_rad);
        }
        let q = hwall::kinematics::JointPositions(q);
        let drawn = self.base_from_board(&q.0);
        let distance_m = drawn.distance(&arm.forward(&q)).position_m;
        if distance_m <= AGREES_M {
            Ok(())
        } else {
            Err(RecordError::OtherArm { distance_m })
        }
    }

    /// Pose of the board from the transforms of all links.
    pub(crate) fn base_from_board(&self, q: &[f64]) -> Pose {
        let links = self.transforms(q).fold(Pose::IDENTITY, |a, b| a * b);
        links * self.last_link_from_board
    }

    /// `previous_from_link` of every joint at its position, rad or m.
    pub(crate) fn transforms<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = Pose> + 'a {
        self.joints.iter().zip(q).map(|(joint, &value)| {
            let axis = joint.axis.normalize_or_zero();
            let moved = match joint.kind {
                JointKind::Revolute => {
                    Pose::from_parts_unchecked(DMat3::from_axis_angle(axis, value), DVec3::ZERO)
                }
                JointKind::Prismatic => Pose::from_parts_unchecked(DMat3::IDENTITY, axis * value),
            };
            joint.previous_from_link * moved
        })
    }

    /// Name of the parent frame of a joint.
    pub(crate) fn parent(&self, joint: usize) -> &str {
        match joint.checked_sub(1).and_then(|i| self.links.get(i)) {
            Some(link) => link,
            None => BASE,
        }
    }

    /// The capsules of the base and of every link: from its own origin to that of the next link.
    pub(crate) fn capsules(&self) -> impl Iterator<Item = (&str, Capsule)> {
        let names = std::iter::once(BASE).chain(self.links.iter().map(String::as_str));
        let flange = self.last_link_from_board.position_m()
            - self.last_link_from_board.rotation().z_axis * self.board.thickness_m;
        let ends = self.joints.iter();
        let ends = ends.map(|joint| joint.previous_from_link.position_m());
        names
            .zip(ends.chain([flange]))
            .enumerate()
            .map(|(number, (name, to_m))| {
                let capsule = Capsule {
                    from_m: DVec3::ZERO,
                    to_m,
                    radius_m: (RADIUS_M - THINNER_M * number as f64).max(THINNER_M),
                };
                (name, capsule)
            })
    }
}
