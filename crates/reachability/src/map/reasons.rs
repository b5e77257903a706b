//! Why the unreachable part of a wall is unreachable.

use crate::error::ReachabilityError;
use crate::line::{ExactSolver, Interval};
use crate::wall::WallPlane;
use hwall_kinematics::{SrsArm, Unreachable, Verdict};
use hwall_numeric::check::{finite, positive};

/// Counts of sampled points of a wall by verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReachabilityReasons {
    /// Reachable.
    pub reachable: usize,
    /// Beyond the stretched arm.
    pub too_far: usize,
    /// Nearer than the links can fold.
    pub too_near: usize,
    /// Joint 4 would have to pass its limit.
    pub elbow_limit: usize,
    /// Joints 1 to 3 cannot, at any arm angle.
    pub shoulder_limit: usize,
    /// Joints 5 to 7 cannot, at any arm angle.
    pub wrist_limit: usize,
    /// Shoulder and wrist can, but not at the same arm angle.
    pub arm_angle_conflict: usize,
    /// Another reason.
    pub other: usize,
}

/// More samples than this are refused.
const MOST_SAMPLES: u128 = 100_000_000;

impl ReachabilityReasons {
    /// Takes the verdict at points `spacing_m` apart, over the intervals `s` along the wall and `z`
    /// of heights.
    ///
    /// Where the solver has a choice of rolls the first one gives the reason; a point that is
    /// reachable at any of them counts as reachable.
    ///
    /// # Errors
    /// NaN or infinity, a spacing that is not positive, or more than 1e8 points.
    pub fn of_wall(
        solver: &ExactSolver,
        plane: &WallPlane,
        s: Interval,
        z: Interval,
        spacing_m: f64,
    ) -> Result<Self, ReachabilityError> {
        positive("spacing_m", spacing_m)?;
        let count = |span: Interval| {
            let steps = finite("extent in steps", span.length_m() / spacing_m)?;
            Ok::<_, ReachabilityError>((steps + 1e-9).floor().max(0.0) as u128 + 1)
        };
        let (columns, rows) = (count(s)?, count(z)?);
        if columns.saturating_mul(rows) > MOST_SAMPLES {
            return Err(ReachabilityError::TooMany {
                what: "samples",
                count: columns.saturating_mul(rows),
                limit: MOST_SAMPLES,
            });
        }
        let mut reasons = Self::default();
        for row in 0..rows {
            let line = plane.line(z.lo_m + spacing_m * row as f64);
            for column in 0..columns {
                let s_m = s.lo_m + spacing_m * column as f64;
                if solver.is_reachable(&line, s_m)? {
                    reasons.reachable += 1;
                } else {
                    let pose = line.board_pose(s_m, solver.first_roll_rad())?;
                    reasons.add(solver.arm(), &pose);
                }
            }
        }
        Ok(reasons)
    }

    fn add(&mut self, arm: &SrsArm, pose: &hwall_kinematics::Pose) {
        let count = match arm.verdict(pose) {
            Verdict::Reachable(_) => &mut self.reachable,
            Verdict::Unreachable(Unreachable::TooFar { .. }) => &mut self.too_far,
            Verdict::Unreachable(Unreachable::TooNear { .. }) => &mut self.too_near,
            Verdict::Unreachable(Unreachable::ElbowLimit { .. }) => &mut self.elbow_limit,
            Verdict::Unreachable(Unreachable::ShoulderLimit) => &mut self.shoulder_limit,
            Verdict::Unreachable(Unreachable::WristLimit) => &mut self.wrist_limit,
            Verdict::Unreachable(Unreachable::ArmAngleConflict) => &mut self.arm_angle_conflict,
            Verdict::Unreachable(_) => &mut self.other,
        };
        *count += 1;
    }

    /// Points in all.
    #[must_use]
    pub fn total(&self) -> usize {
        self.rows().iter().map(|row| row.1).sum()
    }

    /// Names (as in [`Unreachable::name`]) and counts, for tables.
    #[must_use]
    pub const fn rows(&self) -> [(&'static str, usize); 8] {
        [
            ("reachable", self.reachable),
            ("too_far", self.too_far),
            ("too_near", self.too_near),
            ("elbow_limit", self.elbow_limit),
            ("shoulder_limit", self.shoulder_limit),
            ("wrist_limit", self.wrist_limit),
            ("arm_angle_conflict", self.arm_angle_conflict),
            ("other", self.other),
        ]
    }
}
