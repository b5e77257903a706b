//! Exact interval sets along a line, with proof.
//!
//! A line is cut into cells. For each cell the kinematics say "reachable throughout",
//! "unreachable throughout" (both proven, [`SrsArm::region_verdict_between`]) or nothing; then the
//! cell is cut. Where the verdicts at its two ends differ there is an end of an interval between
//! them: it is bisected on the point verdict to rounding, and the proof grows away from it on both
//! sides in cells that widen with the distance, because the slack of the limits does. What stays
//! undecided at the wanted accuracy is reported as a band, never guessed silently.

use super::config::ExactConfig;
use super::family::ArmFamily;
use super::images::{family_of_images, mirrored_rolls};
use super::interval::Interval;
use super::reachability::LineReachability;
use super::search::{FamilyVerdict, LineSearch};
use crate::error::Result;
use crate::plane::PlaneLine;
use crate::wall::WallLine;
use hwall_kinematics::{BranchSet, SrsArm};
use hwall_numeric::check::finite;

/// Exact reachability along lines for an S-R-S arm.
///
/// ```
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{ExactConfig, ExactSolver, WallPlane};
///
/// let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default())?;
/// let wall = WallPlane::new(0.0, 0.526)?; // square before the arm, 0.526 m away
/// let found = solver.line(&wall.line(0.34))?; // at the height of the shoulder
/// assert_eq!(found.intervals.len(), 1);
/// assert!((found.intervals[0].span.hi_m - 0.692_820_323).abs() < 1e-6);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ExactSolver {
    family: ArmFamily,
}

/// How a stretch of a line can be held without a change of branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldStretch {
    /// Roll of the board about the normal, rad.
    pub roll_rad: f64,
    /// The branches that provably hold every proven point of the stretch at this roll.
    pub branches: BranchSet,
}

impl ExactSolver {
    /// For an arm with its tool; the tool's z axis meets the wall along its normal.
    ///
    /// # Errors
    /// An accuracy outside its range, a roll that is NaN or infinite, an empty list of rolls,
    /// a negative extent.
    pub fn new(arm: &SrsArm, config: &ExactConfig) -> Result<Self> {
        let family = ArmFamily::new(arm, config)?;
        Ok(Self { family })
    }

    /// Does every wall look the same in the mirror through base axis and normal?
    pub(crate) fn has_mirror(&self) -> bool {
        mirrored_rolls(self.arm(), self.rolls_rad()).is_some()
    }

    /// For the wall at heading 0 that stands for those at the given headings, rad, and with `mirror` for their mirror
    /// images: what is proven holds for all of them. `None` where they have no angle of some joint in common, or no
    /// mirror.
    pub(crate) fn of_images(&self, headings: &[f64], mirror: bool) -> Result<Option<Self>> {
        let mut rolls = None;
        if mirror {
            rolls = mirrored_rolls(self.arm(), self.rolls_rad());
            if rolls.is_none() {
                return Ok(None);
            }
        }
        let images = family_of_images(self.arm(), headings, rolls.as_deref())?;
        Ok(images.map(|(narrow, wide)| {
            let family = self.family.with_limits_of(narrow, wide);
            Self { family }
        }))
    }

    /// The same for another accuracy, m; not checked.
    pub(crate) fn with_accuracy(&self, accuracy_m: f64) -> Self {
        let mut family = self.family.clone();
        family.accuracy_m = accuracy_m;
        Self { family }
    }

    /// Everything that is reachable of a line.
    ///
    /// # Errors
    /// A line so far away that its points are not finite.
    pub fn line(&self, line: &WallLine) -> Result<LineReachability> {
        self.plane_line(&(*line).into())
    }

    /// Everything that is reachable of a straight line on a plane at any inclination.
    ///
    /// # Errors
    /// As for [`line`](Self::line).
    pub fn plane_line(&self, line: &PlaneLine) -> Result<LineReachability> {
        let found = LineSearch::new(&self.family, line)?.run(false);
        // A single arm agrees with itself.
        Ok(self.touched(found.unwrap_or_default()))
    }

    /// As [`line`](Self::line), but `None` where the family's arms differ. With `mirror` only
    /// s ≥ 0 is searched: for arms, tools and rolls that look the same in a mirror.
    pub(crate) fn line_of_family(
        &self,
        line: &WallLine,
        mirror: bool,
    ) -> Result<Option<LineReachability>> {
        let found = LineSearch::new(&self.family, &(*line).into())?.run(mirror);
        Ok(found.map(|found| self.touched(found)))
    }

    /// As [`line_of_family`](Self::line_of_family), with branches that mean nothing.
    pub(crate) fn spans_of_family(
        &self,
        line: &WallLine,
        mirror: bool,
    ) -> Result<Option<LineReachability>> {
        let mut search = LineSearch::new(&self.family, &(*line).into())?;
        let found = search.run_without_branches(mirror);
        Ok(found.map(|found| self.touched(found)))
    }

    /// Where any part of the board counts, every point within its half width.
    fn touched(&self, found: LineReachability) -> LineReachability {
        match self.family.half_width_m {
            half_width_m if half_width_m > 0.0 => found.dilated(half_width_m),
            _ => found,
        }
    }

    /// All branches that provably hold every proven point of a stretch of a line at one roll: the
    /// first roll of those with most branches. No branches for a free roll of a tilted tool or
    /// where any part of the board counts.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn branches_along(&self, line: &WallLine, span: Interval) -> Result<HeldStretch> {
        finite("lo_m", span.lo_m)?;
        finite("hi_m", span.hi_m)?;
        if self.family.is_free() {
            return Ok(HeldStretch {
                roll_rad: self.first_roll_rad(),
                branches: BranchSet::EMPTY,
            });
        }
        let mut search = LineSearch::new(&self.family, &(*line).into())?;
        // Leaves the pieces of the line behind, each proven by itself.
        let _ = search.run(false);
        let hold = search.branches_along(span);
        Ok(HeldStretch {
            roll_rad: self.family.freedoms[hold.roll].roll,
            branches: hold.branches,
        })
    }

    /// The verdict at one point of a line.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn is_reachable(&self, line: &WallLine, s_m: f64) -> Result<bool> {
        finite("s_m", s_m)?;
        let search = LineSearch::new(&self.family, &(*line).into())?;
        Ok(search.verdict_within(s_m, self.family.half_width_m) == FamilyVerdict::Reachable)
    }

    /// The arm, with its last joint free where the roll is.
    pub(crate) const fn arm(&self) -> &SrsArm {
        &self.family.narrow
    }

    /// The arms behind it, for proofs of other regions than lines.
    pub(crate) const fn family(&self) -> &ArmFamily {
        &self.family
    }

    /// The rolls that it may choose from, rad: middles of arcs for a free roll.
    pub(crate) fn rolls_rad(&self) -> impl Iterator<Item = f64> + '_ {
        self.family.freedoms.iter().map(|f| f.roll)
    }

    /// The first roll that it was given, rad.
    pub(crate) fn first_roll_rad(&self) -> f64 {
        self.family.freedoms[0].roll
    }

    /// Accuracy of the ends, m.
    #[must_use]
    pub const fn accuracy_m(&self) -> f64 {
        self.family.accuracy_m
    }
}
