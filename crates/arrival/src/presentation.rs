//! All configurations that present the board at a place: branches, arm angles and rolls.

use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::{
    ArmKinematics, Branch, BranchPolicy, JointLimit, JointPositions, MOST_JOINTS, NearestConfig,
    SrsArm,
};
use hwall_reachability::WallPlane;
use std::f64::consts::{PI, TAU};

use crate::length::turning;

/// A configuration that presents the board at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Presentation {
    pub(crate) q: JointPositions,
    /// Branch and arm angle are only meaningful with a closed form.
    pub(crate) branch: Branch,
    pub(crate) arm_angle_rad: f64,
    /// Index of the roll.
    pub(crate) roll: u8,
}

/// Configurations for presenting the board, for any arm.
#[derive(Debug, Clone)]
pub(crate) enum Holding<'a> {
    /// All of them, in closed form.
    Exact(Box<Presenter>),
    /// Those found by a numerical search.
    Searched {
        arm: &'a dyn ArmKinematics,
        rolls_rad: Vec<f64>,
        /// Initial configurations besides `near`.
        from: Vec<JointPositions>,
        turning: [bool; MOST_JOINTS],
    },
}

impl<'a> Holding<'a> {
    /// Number of initial configurations besides `near`.
    const SEARCHES: u32 = 5;

    /// With a closed form, arm angles are at most `spacing_rad` apart.
    pub(crate) fn new(arm: &'a dyn ArmKinematics, rolls_rad: &[f64], spacing_rad: f64) -> Self {
        if let Some(arm) = arm.closed_form() {
            return Self::Exact(Box::new(Presenter::new(arm, rolls_rad, spacing_rad)));
        }
        let from = (0..Self::SEARCHES).map(|i| JointPositions::spread(arm.limits(), i));
        Self::Searched {
            arm,
            rolls_rad: rolls_rad.to_vec(),
            from: from.collect(),
            turning: turning(arm),
        }
    }

    /// The presenter, if the arm has a closed form.
    pub(crate) fn exact(&self) -> Option<&Presenter> {
        match self {
            Self::Exact(presenter) => Some(presenter),
            Self::Searched { .. } => None,
        }
    }

    pub(crate) fn rolls_rad(&self) -> &[f64] {
        match self {
            Self::Exact(presenter) => &presenter.rolls_rad,
            Self::Searched { rolls_rad, .. } => rolls_rad,
        }
    }

    /// Appends the configurations that hold the board at a point of a plane; see [`Presenter::present`].
    pub(crate) fn present(
        &self,
        plane: &WallPlane,
        point_m: DVec3,
        near: &JointPositions,
        out: &mut Vec<Presentation>,
    ) {
        match self {
            Self::Exact(presenter) => presenter.present(plane, point_m, near, out),
            Self::Searched {
                arm,
                rolls_rad,
                from,
                turning,
            } => {
                let config = NearestConfig {
                    policy: BranchPolicy::Any,
                    ..NearestConfig::default()
                };
                let mut scratch = arm.scratch();
                for (roll, roll_rad) in rolls_rad.iter().enumerate() {
                    let Ok(pose) = Pose::new(plane.board_rotation(*roll_rad), point_m) else {
                        return;
                    };
                    for from in std::iter::once(near).chain(from) {
                        let Ok(found) = arm.nearest(&pose, from, &config, &mut scratch) else {
                            // If a search fails, the roll is skipped.
                            break;
                        };
                        let mut q = found.q;
                        for joint in (0..MOST_JOINTS).filter(|joint| turning[*joint]) {
                            q[joint] = arm.limits()[joint].nearest_turn(q[joint], near[joint]);
                        }
                        out.push(Presentation {
                            q,
                            branch: Branch::ALL[0],
                            arm_angle_rad: 0.0,
                            roll: roll as u8,
                        });
                    }
                }
            }
        }
    }
}

/// Enumerates configurations of an arm with a closed form.
#[derive(Debug, Clone)]
pub(crate) struct Presenter {
    arm: SrsArm,
    /// Without the limit of joint 7, if a roll only changes joint 7.
    free_turn: Option<SrsArm>,
    rolls_rad: Vec<f64>,
    arm_angles_rad: Vec<f64>,
}

impl Presenter {
    /// Arm angles are at most `spacing_rad` apart.
    pub(crate) fn new(arm: &SrsArm, rolls_rad: &[f64], spacing_rad: f64) -> Self {
        let tool = arm.flange_from_tool();
        let (offset, axis) = (tool.position_m(), tool.rotation().z_axis);
        // Tolerance for rounding of a centred tool.
        let centred = offset.truncate().length() < 1e-14 && axis.truncate().length() < 1e-14;
        let free_turn = if centred && axis.z > 0.0 {
            let mut limits = *arm.limits();
            limits[6] = JointLimit::FREE;
            arm.with_limits(limits).ok()
        } else {
            None
        };
        let count = (TAU / spacing_rad).ceil().clamp(1.0, 3600.0) as usize;
        let arm_angles_rad = (0..count).map(|i| TAU * i as f64 / count as f64 - PI);
        Self {
            arm: arm.clone(),
            free_turn,
            rolls_rad: rolls_rad.to_vec(),
            arm_angles_rad: arm_angles_rad.collect(),
        }
    }

    fn pose(&self, plane: &WallPlane, point_m: DVec3, roll: usize) -> Option<Pose> {
        Pose::new(plane.board_rotation(self.rolls_rad[roll]), point_m).ok()
    }

    /// Appends the configurations that present the board at a point of a plane. Joints without limits, or with more than a turn, are turned towards
    /// `near`. Appends none if the place is out of reach.
    pub(crate) fn present(
        &self,
        plane: &WallPlane,
        point_m: DVec3,
        near: &JointPositions,
        out: &mut Vec<Presentation>,
    ) {
        /// With fewer solutions the place is near the limit of reach, and exact arcs are used.
        const FEW: usize = 6;
        let before = out.len();
        let count = self.rolls_rad.len();
        // A free last joint turns a solution into those of the other rolls.
        let (arm, solved, turned) = match &self.free_turn {
            Some(arm) => (arm, 1, count),
            None => (&self.arm, count, 1),
        };
        for first in 0..solved {
            let Some(pose) = self.pose(plane, point_m, first) else {
                return;
            };
            for &arm_angle_rad in &self.arm_angles_rad {
                let found = arm.solutions(&pose, arm_angle_rad);
                for (branch, solution) in Branch::ALL.into_iter().zip(found) {
                    let Some(solution) = solution else { continue };
                    for roll in first..first + turned {
                        let mut q = solution;
                        q[6] += self.rolls_rad[roll] - self.rolls_rad[first];
                        self.push(q, near, branch, arm_angle_rad, roll, out);
                    }
                }
            }
        }
        if out.len() < before + FEW {
            self.present_on_arcs(plane, point_m, near, out);
        }
    }

    /// Uses exact arm angle intervals, because the grid may miss narrow ones.
    fn present_on_arcs(
        &self,
        plane: &WallPlane,
        point_m: DVec3,
        near: &JointPositions,
        out: &mut Vec<Presentation>,
    ) {
        for roll in 0..self.rolls_rad.len() {
            let Some(pose) = self.pose(plane, point_m, roll) else {
                return;
            };
            let Ok(angles) = self.arm.feasible_arm_angles(&pose) else {
                continue;
            };
            for branch in angles.branches() {
                for arc in angles.arcs(branch) {
                    for share in [0.5, 0.1, 0.9] {
                        let arm_angle_rad = arc.start_rad + share * arc.width_rad();
                        let q = angles.configuration(&self.arm, branch, arm_angle_rad, near);
                        if let Some(q) = q {
                            self.push(q, near, branch, arm_angle_rad, roll, out);
                        }
                    }
                }
            }
        }
    }

    /// The configuration with the branch and roll of `like` at one arm angle, if within the limits.
    pub(crate) fn at(
        &self,
        plane: &WallPlane,
        point_m: DVec3,
        like: &Presentation,
        arm_angle_rad: f64,
    ) -> Option<Presentation> {
        let pose = self.pose(plane, point_m, usize::from(like.roll))?;
        let mut q = self.arm.solutions(&pose, arm_angle_rad)[like.branch.index()]?;
        self.turn_towards(&mut q, &like.q)?;
        Some(Presentation {
            q,
            arm_angle_rad,
            ..*like
        })
    }

    fn push(
        &self,
        mut q: JointPositions,
        near: &JointPositions,
        branch: Branch,
        arm_angle_rad: f64,
        roll: usize,
        out: &mut Vec<Presentation>,
    ) {
        if self.turn_towards(&mut q, near).is_some() {
            out.push(Presentation {
                q,
                branch,
                arm_angle_rad,
                roll: roll as u8,
            });
        }
    }

    /// Turns each joint by full turns to the angle within its limit nearest to `near`; `None` if there is none.
    fn turn_towards(&self, q: &mut JointPositions, near: &JointPositions) -> Option<()> {
        for joint in (0..MOST_JOINTS).step_by(2) {
            let limit = &self.arm.limits()[joint];
            let ideal = q[joint] - TAU * ((q[joint] - near[joint]) / TAU).round();
            let turned = [ideal, ideal - TAU, ideal + TAU];
            q[joint] = turned.into_iter().find(|angle| limit.contains(*angle))?;
        }
        Some(())
    }
}
