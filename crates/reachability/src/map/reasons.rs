//! Why the unreachable part of a wall is unreachable.

use crate::error::{ReachabilityError, Result};
use crate::line::{ExactSolver, Interval};
use crate::wall::WallPlane;
use hwall_kinematics::Verdict;
use hwall_numeric::check::{finite, positive};

/// Counts of sampled points of a wall by verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReachabilityReasons {
    counts: [usize; NAMES.len()],
}

/// Names of the counts: those of [`Unreachable::name`](hwall_kinematics::Unreachable::name), and any other reason.
const NAMES: [&str; 8] = [
    "reachable",
    "too_far",
    "too_near",
    "elbow_limit",
    "shoulder_limit",
    "wrist_limit",
    "arm_angle_conflict",
    "other",
];

/// Maximum number of samples.
const MOST_SAMPLES: u128 = 100_000_000;

impl ReachabilityReasons {
    /// Samples verdicts at points `spacing_m` apart, over the intervals `s` along the wall and `z` of heights.
    ///
    /// With several rolls, a point that is reachable at any of them counts as reachable; otherwise the first roll gives the reason.
    ///
    /// # Errors
    /// NaN or infinity, a spacing that is not positive, or more than 1e8 points.
    pub fn of_wall(
        solver: &ExactSolver,
        plane: &WallPlane,
        s: Interval,
        z: Interval,
        spacing_m: f64,
    ) -> Result<Self> {
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
        let roll_rad = solver.first_roll_rad();
        for row in 0..rows {
            let line = plane.line(z.lo_m + spacing_m * row as f64);
            for column in 0..columns {
                let s_m = s.lo_m + spacing_m * column as f64;
                let name = if solver.is_reachable(&line, s_m)? {
                    NAMES[0]
                } else {
                    match solver.arm().verdict(&line.board_pose(s_m, roll_rad)?) {
                        Verdict::Reachable(_) => NAMES[0],
                        Verdict::Unreachable(reason) => reason.name(),
                    }
                };
                let place = NAMES.iter().position(|known| *known == name);
                reasons.counts[place.unwrap_or(NAMES.len() - 1)] += 1;
            }
        }
        Ok(reasons)
    }

    /// Total number of points.
    #[must_use]
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Names (as in [`Unreachable::name`](hwall_kinematics::Unreachable::name)) and counts, for tables: reachable, too far, too near, out of reach
    /// because of the limits of elbow, shoulder or wrist, shoulder and wrist limits not satisfied at the same arm angle, and any other reason.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, usize); NAMES.len()] {
        std::array::from_fn(|i| (NAMES[i], self.counts[i]))
    }
}
