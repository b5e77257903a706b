//! Exact interval sets along a line, with proof.
//!
//! A line is divided into cells. For each cell the kinematics prove "reachable throughout" or
//! "unreachable throughout" ([`SrsArm::region_verdict_between`]), or leave the cell undecided; an
//! undecided cell is subdivided. If the verdicts at the two ends of a cell differ, an interval ends
//! between them. That end is bisected with the point verdict, and the proof is extended away from
//! it on both sides. The cells widen with the distance from the end, because the margin to the
//! limits grows. Parts that are undecided at the requested accuracy are reported as bands, never
//! guessed.

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

/// How a stretch of a line can be held without changing branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldStretch {
    /// Roll of the board about the normal, rad.
    pub roll_rad: f64,
    /// The branches that provably hold every proven point of the stretch at this roll.
    pub branches: BranchSet,
}

impl ExactSolver {
    /// For an arm with its tool; the tool's z axis is along the wall's normal.
    ///
    /// # Errors
    /// An accuracy outside its range, a roll that is NaN or infinite, an empty list of rolls,
    /// a negative extent.
    pub fn new(arm: &SrsArm, config: &ExactConfig) -> Result<Self> {
        let family = ArmFamily::new(arm, config)?;
        Ok(Self { family })
    }

    /// True if tool and rolls are symmetric under reflection in the plane of base axis and wall normal.
    pub(crate) fn has_mirror(&self) -> bool {
        mirrored_rolls(self.arm(), self.rolls_rad()).is_some()
    }

    /// Solver for the wall at heading 0, which represents the walls at the given headings, rad, and with `mirror` their
    /// mirror images: every proof is valid for all of them. `None` if the images share no angle of some joint, or have no
    /// mirror symmetry.
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

    /// The same solver with another accuracy, m; not checked.
    pub(crate) fn with_accuracy(&self, accuracy_m: f64) -> Self {
        let mut family = self.family.clone();
        family.accuracy_m = accuracy_m;
        Self { family }
    }

    /// The reachable part of a line.
    ///
    /// # Errors
    /// A line so far away that its points are not finite.
    pub fn line(&self, line: &WallLine) -> Result<LineReachability> {
        self.plane_line(&(*line).into())
    }

    /// The reachable part of a straight line on a plane at any inclination.
    ///
    /// # Errors
    /// As for [`line`](Self::line).
    pub fn plane_line(&self, line: &PlaneLine) -> Result<LineReachability> {
        let found = LineSearch::new(&self.family, line)?.run(false);
        // Never `None` for a single arm.
        Ok(self.touched(found.unwrap_or_default()))
    }

    /// As [`line`](Self::line), but `None` if the arms of the family differ. With `mirror` only s ≥
    /// 0 is searched: for mirror-symmetric arms, tools and rolls.
    pub(crate) fn line_of_family(
        &self,
        line: &WallLine,
        mirror: bool,
    ) -> Result<Option<LineReachability>> {
        let found = LineSearch::new(&self.family, &(*line).into())?.run(mirror);
        Ok(found.map(|found| self.touched(found)))
    }

    /// As [`line_of_family`](Self::line_of_family), but the branches are not valid.
    pub(crate) fn spans_of_family(
        &self,
        line: &WallLine,
        mirror: bool,
    ) -> Result<Option<LineReachability>> {
        let mut search = LineSearch::new(&self.family, &(*line).into())?;
        let found = search.run_without_branches(mirror);
        Ok(found.map(|found| self.touched(found)))
    }

    /// Extends the set by the half width if any part of the board counts.
    fn touched(&self, found: LineReachability) -> LineReachability {
        match self.family.half_width_m {
            half_width_m if half_width_m > 0.0 => found.dilated(half_width_m),
            _ => found,
        }
    }

    /// All branches that provably hold every proven point of a stretch of a line at one roll: the first roll
    /// with the most branches. No branches for a free roll of a tilted tool or if any part of the board counts.
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
        // Run only for its side effect: the proven pieces of the line.
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

    /// The arm, with its last joint unlimited if the roll is free.
    pub(crate) const fn arm(&self) -> &SrsArm {
        &self.family.narrow
    }

    /// The family of arms, for proofs about regions other than lines.
    pub(crate) const fn family(&self) -> &ArmFamily {
        &self.family
    }

    /// The allowed rolls, rad: middles of arcs for a free roll.
    pub(crate) fn rolls_rad(&self) -> impl Iterator<Item = f64> + '_ {
        self.family.freedoms.iter().map(|f| f.roll)
    }

    /// The first configured roll, rad.
    pub(crate) fn first_roll_rad(&self) -> f64 {
        self.family.freedoms[0].roll
    }

    /// Accuracy of the ends, m.
    #[must_use]
    pub const fn accuracy_m(&self) -> f64 {
        self.family.accuracy_m
    }
}
