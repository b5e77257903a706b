//! The arm as shown: joints and capsules.

use glam::DVec3;
use hwall::geometry::Pose;
use hwall::kinematics::{ArmKinematics, JointLimit, JointPositions, MOST_JOINTS, foot_on_second};

/// A joint, in the frame of the previous joint (of the base for the first). Its own frame moves with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewJoint {
    /// Pose of the joint at position zero.
    pub parent_from_joint: Pose,
    /// Unit axis in the joint's own frame.
    pub axis: DVec3,
    /// Does it slide along its axis instead of turning about it?
    pub slides: bool,
    /// Joint limit, rad or m.
    pub limit: JointLimit,
}

/// A piece of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewCapsule {
    /// Frame that it moves with: 0 is the base, `i` is joint `i`.
    pub frame: usize,
    /// One end of the segment in that frame, m.
    pub from_m: DVec3,
    /// The other end, m.
    pub to_m: DVec3,
    /// Radius, m.
    pub radius_m: f64,
    /// Is it the housing of a joint, not a link? Housings have another colour.
    pub housing: bool,
}

/// An arm as joints and capsules. While all joints are at zero, the axes of all joint frames are parallel to those of the base.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewArm {
    /// Joints, from the base outwards.
    pub joints: Vec<ViewJoint>,
    /// Links and housings.
    pub capsules: Vec<ViewCapsule>,
    /// The tool in the frame of the last joint.
    pub joint_from_tool: Pose,
}

/// Points closer together than this are one point, m.
const SAME_M: f64 = 1e-3;

impl ViewArm {
    /// From any arm, by its joint axes alone: links run between the points where neighbouring axes meet or are closest.
    #[must_use]
    pub fn of(arm: &dyn ArmKinematics) -> Self {
        let zero = JointPositions::default();
        let jacobian = arm.jacobian(&zero);
        let base_from_tool = arm.forward(&zero);
        let tool_m = base_from_tool.position_m();
        let count = arm.joint_count().min(MOST_JOINTS);
        // For each joint: a point on its axis, the axis, and whether the joint slides.
        let mut axes: Vec<(DVec3, DVec3, bool)> = Vec::with_capacity(count);
        for joint in 0..count {
            let (last_m, last_axis) = axes.last().map_or((DVec3::ZERO, DVec3::Z), |a| (a.0, a.1));
            let turn = jacobian.angular[joint];
            axes.push(match turn.try_normalize() {
                Some(axis) => {
                    let on_axis_m = tool_m - jacobian.linear[joint].cross(axis);
                    let foot_m = match joint {
                        0 => on_axis_m + axis * (last_m - on_axis_m).dot(axis),
                        _ => foot_on_second(last_m, last_axis, on_axis_m, axis, last_m),
                    };
                    (foot_m, axis, false)
                }
                None => {
                    let axis = jacobian.linear[joint].normalize_or(DVec3::Z);
                    (last_m, axis, true)
                }
            });
        }
        let mut joints = Vec::with_capacity(count);
        let mut before_m = DVec3::ZERO;
        for ((point_m, axis, slides), limit) in axes.iter().zip(arm.limits()) {
            joints.push(ViewJoint {
                parent_from_joint: Pose::IDENTITY.at(*point_m - before_m),
                axis: *axis,
                slides: *slides,
                limit: *limit,
            });
            before_m = *point_m;
        }
        Self {
            capsules: capsules(&axes, tool_m),
            joint_from_tool: base_from_tool.at(tool_m - before_m),
            joints,
        }
    }

    /// Poses of base, joints and tool, `base_from_...`, at a configuration.
    #[must_use]
    pub fn poses(&self, q: &JointPositions) -> Vec<Pose> {
        let mut poses = Vec::with_capacity(self.joints.len() + 2);
        let mut pose = Pose::IDENTITY;
        poses.push(pose);
        for (joint, q) in self.joints.iter().zip(q.0) {
            let q = if q.is_finite() { q } else { 0.0 };
            let moved = if joint.slides {
                Pose::IDENTITY.at(joint.axis * q)
            } else {
                let turn = glam::DMat3::from_axis_angle(joint.axis, q);
                Pose::from_parts_unchecked(turn, DVec3::ZERO)
            };
            pose = pose * joint.parent_from_joint * moved;
            poses.push(pose);
        }
        poses.push(pose * self.joint_from_tool);
        poses
    }
}

/// Radii at base and tool, relative to the size of the arm: those of an iiwa, for a reach of 0.95 m.
const BASE_RADIUS: f64 = 0.088;
const TOOL_RADIUS: f64 = 0.052;
/// Approximate thickness of a board, m.
const CARRIED_M: f64 = 0.02;

fn capsules(axes: &[(DVec3, DVec3, bool)], tool_m: DVec3) -> Vec<ViewCapsule> {
    let mut points_m = vec![DVec3::ZERO];
    points_m.extend(axes.iter().map(|a| a.0));
    points_m.push(tool_m);
    let length_m: f64 = points_m.windows(2).map(|p| p[0].distance(p[1])).sum();
    let share = |along_m: f64| along_m / length_m.max(SAME_M);
    let radius_m = |along_m: f64| {
        length_m.max(SAME_M) / 1.266 * (BASE_RADIUS + (TOOL_RADIUS - BASE_RADIUS) * share(along_m))
    };
    let mut capsules = Vec::new();
    let mut along_m = 0.0;
    for (i, pair) in points_m.windows(2).enumerate() {
        let middle_m = along_m + 0.5 * pair[0].distance(pair[1]);
        // Piece i moves with joint i and starts there.
        let origin_m = if i == 0 { DVec3::ZERO } else { pair[0] };
        let link = (pair[1] - pair[0]).normalize_or_zero();
        let long_m = pair[0].distance(pair[1]);
        if long_m > SAME_M {
            let round_m = 0.86 * radius_m(middle_m);
            // The last link ends before the board that it carries.
            let end_m = if i == axes.len() {
                (long_m - round_m - CARRIED_M).max(0.0)
            } else {
                long_m
            };
            capsules.push(ViewCapsule {
                frame: i,
                from_m: pair[0] - origin_m,
                to_m: pair[0] - origin_m + link * end_m,
                radius_m: round_m,
                housing: false,
            });
        }
        along_m += long_m;
        // A housing along the next joint's axis, if that axis crosses the link.
        let Some((_, axis, false)) = axes.get(i) else {
            continue;
        };
        if long_m > SAME_M && link.dot(*axis).abs() < 0.7 {
            let half_m = 0.62 * radius_m(along_m);
            capsules.push(ViewCapsule {
                frame: i + 1,
                from_m: -*axis * half_m,
                to_m: *axis * half_m,
                radius_m: radius_m(along_m),
                housing: true,
            });
        }
    }
    capsules
}
