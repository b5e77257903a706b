//! The exact sets of feasible arm angles, one per branch.

use crate::joints::JointPositions;
use crate::srs::branch::Branch;
use crate::srs::circle::{BaseSolution, CROSS_TOLERANCE, Direction, ElbowCircle};
use crate::srs::model::SrsArm;
use crate::trig;
use crate::unreachable::Unreachable;
use hwall_geometry::Pose;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// At most 32 arm angles lie on a limit (8 ends of turning joints, 8 of tilting ones, two roots each), plus 4
/// extremes and 8 sums of coupled joints. A multiple of four, because angles are processed in groups of four.
const CAPACITY: usize = 44;

/// A closed arc of arm angles, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmAngleArc {
    /// First angle, in `[-π, π]`.
    pub start_rad: f64,
    /// Last angle, `start_rad ..= start_rad + 2π`; equal to the first for a single angle.
    pub end_rad: f64,
}

impl ArmAngleArc {
    /// Length of the arc, rad.
    #[must_use]
    pub fn width_rad(&self) -> f64 {
        self.end_rad - self.start_rad
    }

    /// The angle of the arc nearest to `arm_angle_rad` on the circle, in the arc's range.
    #[must_use]
    pub fn nearest_rad(&self, arm_angle_rad: f64) -> f64 {
        let middle = 0.5 * (self.start_rad + self.end_rad);
        let turned = arm_angle_rad - TAU * ((arm_angle_rad - middle) / TAU).round();
        turned.clamp(self.start_rad, self.end_rad)
    }
}

/// All arm angles that hold a pose within the limits.
#[derive(Debug, Clone)]
pub struct FeasibleArmAngles {
    pub(super) circle: ElbowCircle,
    /// Angles at which some joint is at a limit, ascending, rad.
    breaks: [f64; CAPACITY],
    len: usize,
    /// Feasible branches at each break, and between each break and the next.
    at: [u8; CAPACITY],
    after: [u8; CAPACITY],
}

impl SrsArm {
    /// The feasible arm angles of a pose, exactly: the ends are roots of the limit equations.
    ///
    /// # Errors
    /// The reason why there is none; an expected result, not a failure.
    pub fn feasible_arm_angles(
        &self,
        base_from_tool: &Pose,
    ) -> Result<FeasibleArmAngles, Unreachable> {
        let flange_pose = self.flange_pose(base_from_tool);
        let place = self.find_place(&flange_pose)?;
        Ok(FeasibleArmAngles::new(self, place.circle))
    }
}

impl FeasibleArmAngles {
    pub(super) fn new(arm: &SrsArm, circle: ElbowCircle) -> Self {
        let mut directions = [Direction::ZERO; CAPACITY];
        let mut len = 0;
        let mut add = |psi: Direction| {
            directions[len] = psi;
            len += 1;
        };
        for psi in circle.extremes() {
            add(psi);
        }
        circle.limit_roots(&arm.windows, CROSS_TOLERANCE, &mut add);
        circle.coupled_roots(arm.limits(), &mut add);
        let mut places = [(0.0, Direction::ZERO); CAPACITY];
        let fours = directions[..len.next_multiple_of(4)].as_chunks::<4>().0;
        for (places, four) in places.as_chunks_mut::<4>().0.iter_mut().zip(fours) {
            let angles = trig::atan2(&four.map(|psi| psi.sin), &four.map(|psi| psi.cos));
            for ((place, angle), psi) in places.iter_mut().zip(angles).zip(four) {
                *place = (angle, *psi);
            }
        }
        places[..len].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let breaks = places.map(|(angle, _)| angle);
        let mut at = [0; CAPACITY];
        let mut after = [0; CAPACITY];
        let branches = |psi| circle.feasible_branches(&arm.windows, arm.limits(), psi);
        for i in 0..len {
            let (next, turn) = if i + 1 < len { (i + 1, 0.0) } else { (0, TAU) };
            at[i] = branches(places[i].1);
            after[i] = branches(if breaks[next] + turn - breaks[i] < FRAC_PI_2 {
                places[i].1.between(places[next].1)
            } else {
                Direction::from_angle(0.5 * (breaks[i] + (breaks[next] + turn)))
            });
        }
        // The sets are closed: an end belongs to the arc it ends.
        for i in 0..len {
            at[i] |= after[i] | after[(i + len - 1) % len];
        }
        Self {
            circle,
            breaks,
            len,
            at,
            after,
        }
    }

    /// Branches that have any feasible arm angle, in the order of [`Branch::ALL`].
    pub fn branches(&self) -> impl Iterator<Item = Branch> + use<> {
        Branch::in_mask(self.at[..self.len].iter().fold(0, |mask, m| mask | m))
    }

    /// The arcs of one branch, starts ascending within one turn.
    pub fn arcs(&self, branch: Branch) -> impl Iterator<Item = ArmAngleArc> + '_ {
        let bit = branch.bit();
        let n = self.len;
        // Start after a gap, so that no arc is split at ±π.
        let gap = (0..n).find(|&i| self.after[i] & bit == 0);
        let first = gap.map_or(0, |i| i + 1);
        let mut step = 0;
        let mut whole = gap.is_none() && self.after[..n].iter().any(|m| m & bit != 0);
        let full = whole;
        std::iter::from_fn(move || {
            if full {
                return std::mem::take(&mut whole).then_some(ArmAngleArc {
                    start_rad: -PI,
                    end_rad: PI,
                });
            }
            while step < n {
                let i = (first + step) % n;
                step += 1;
                if self.at[i] & bit == 0 {
                    continue;
                }
                let start_rad = self.breaks[i];
                let mut last = i;
                while self.after[last] & bit != 0 && step < n {
                    last = (first + step) % n;
                    step += 1;
                }
                let turn = if self.breaks[last] < start_rad {
                    TAU
                } else {
                    0.0
                };
                return Some(ArmAngleArc {
                    start_rad,
                    end_rad: self.breaks[last] + turn,
                });
            }
            None
        })
    }

    /// The configuration of a branch at an arm angle, or `None` outside its arcs.
    ///
    /// Each angle is shifted by full turns to the value within its limit nearest to `reference`.
    #[must_use]
    pub fn configuration(
        &self,
        arm: &SrsArm,
        branch: Branch,
        arm_angle_rad: f64,
        reference: &JointPositions,
    ) -> Option<JointPositions> {
        BaseSolution::new(&self.circle, Direction::from_angle(arm_angle_rad)).on_branch(
            arm.limits(),
            branch,
            reference,
        )
    }
}
