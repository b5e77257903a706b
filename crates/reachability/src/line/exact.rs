//! Exact interval sets along a line, with proof.
//!
//! A line is cut into cells. For each cell the kinematics say "reachable throughout",
//! "unreachable throughout" (both proven, [`SrsArm::reach_region_between`]) or nothing; then the
//! cell is cut. Where the verdicts at its two ends differ there is an end of an interval between
//! them: it is bisected on the point verdict to rounding, and the proof grows away from it on both
//! sides in cells that widen with the distance, because the slack of the limits does. What stays
//! undecided at the asked accuracy is reported as a band, never guessed silently.

use crate::error::{finite, non_negative, positive};
use crate::line::reachability::LineReach;
use crate::line::search::{LineSearch, Verdict};
use crate::{Interval, ReachabilityError, WallLine};
use hwall_kinematics::{BranchSet, JointLimit, SrsArm};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// Accuracies, relative to the arm's length: finer, and rounding of the poses decides; coarser,
/// and nothing is left to prove.
const FINEST: f64 = 1e-10;
const COARSEST: f64 = 0.1;

/// The finest where a touch or a roll is to be searched.
const FINEST_FREE: f64 = 5e-7;

/// How the board may be turned about the wall's normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Roll {
    /// One roll, rad; at 0 the tool's y axis points up.
    Fixed(f64),
    /// Any of these, rad: a square board covers the same area at four rolls.
    AnyOf(Vec<f64>),
    /// Any roll at all: a round board, or a contact at a point.
    Free,
}

impl Roll {
    /// The four rolls of a square board.
    #[must_use]
    pub fn quarter_turns() -> Self {
        Self::AnyOf(vec![0.0, FRAC_PI_2, PI, -FRAC_PI_2])
    }
}

/// Which part of the board must be where the wall is touched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Touch {
    /// The tool point: the middle of the board.
    Middle,
    /// Any point of a rectangle about the tool point, up to its corners. The sides are horizontal
    /// and vertical at the rolls that the solver is given (multiples of a quarter turn, for a
    /// rectangle that is no square only half turns).
    Anywhere {
        /// Half of the horizontal side, m.
        half_width_m: f64,
        /// Half of the vertical side, m.
        half_height_m: f64,
    },
}

impl Touch {
    /// Anywhere on the dissertation's board of 200 x 200 mm.
    #[must_use]
    pub const fn board_200_mm() -> Self {
        Self::Anywhere {
            half_width_m: 0.1,
            half_height_m: 0.1,
        }
    }
}

/// What the exact solver is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExactConfig {
    /// Each end is known to this, m, and a hole or an island wider than this is found or covered
    /// by a band; default 1e-6. Below 1e-10 or above 0.1 arm lengths is an error, below 5e-7 arm
    /// lengths also where the touch or the roll of a tilted tool is free, which must be searched.
    pub accuracy_m: f64,
    /// How the board may be turned; default fixed at 0.
    pub roll: Roll,
    /// Which part of the board counts; default its middle. [`Touch::Anywhere`] costs about fifty
    /// times as much.
    pub touch: Touch,
}

impl Default for ExactConfig {
    fn default() -> Self {
        Self {
            accuracy_m: 1e-6,
            roll: Roll::Fixed(0.0),
            touch: Touch::Middle,
        }
    }
}

/// Exact reachability along lines for an S-R-S arm.
///
/// ```
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{ExactConfig, ExactSolver, WallPlane};
///
/// let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default())?;
/// let wall = WallPlane::new(0.0, 0.526)?; // square before the arm, 0.526 m away
/// let reach = solver.line(&wall.line(0.34))?; // at the height of the shoulder
/// assert_eq!(reach.intervals.len(), 1);
/// assert!((reach.intervals[0].span.hi_m - 0.692_820_323).abs() < 1e-6);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ExactSolver {
    /// With the narrowest and the widest limits of a family of arms; usually the same.
    pub(crate) narrow: SrsArm,
    pub(crate) wide: SrsArm,
    /// Do they differ?
    pub(crate) is_family: bool,
    /// What the board may do while its touched point stays on the line.
    pub(crate) freedoms: Vec<Freedom>,
    pub(crate) accuracy_m: f64,
    /// Half of the board's touched width, m.
    pub(crate) half_width_m: f64,
}

/// Rolls from `roll - half_roll` to `roll + half_roll`, rad, and heights of the tool point above
/// the line from `rise - half_rise` to `rise + half_rise`, m: any of them will do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Freedom {
    pub(crate) roll: f64,
    pub(crate) half_roll: f64,
    pub(crate) half_rise: f64,
}

impl ExactSolver {
    /// For an arm with its tool; the tool's z axis meets the wall along its normal.
    ///
    /// # Errors
    /// An accuracy outside its range, a roll that is NaN or infinite, an empty list of rolls,
    /// a negative extent.
    pub fn new(arm: &SrsArm, config: &ExactConfig) -> Result<Self, ReachabilityError> {
        Self::for_family(arm, arm, config)
    }

    /// For a family of arms that differ in their limits: what is proven holds for all of them.
    pub(crate) fn for_family(
        narrow: &SrsArm,
        wide: &SrsArm,
        config: &ExactConfig,
    ) -> Result<Self, ReachabilityError> {
        let accuracy_m = positive("accuracy_m", config.accuracy_m)?;
        let size = size_m(narrow);
        if accuracy_m < FINEST * size || accuracy_m > COARSEST * size {
            return Err(ReachabilityError::Parameter {
                what: "accuracy_m",
                value: accuracy_m,
                wanted: "between 1e-10 and 0.1 lengths of the stretched arm",
            });
        }
        let (half_width_m, half_height_m) = match config.touch {
            Touch::Middle => (0.0, 0.0),
            Touch::Anywhere {
                half_width_m,
                half_height_m,
            } => (
                non_negative("half_width_m", half_width_m)?,
                non_negative("half_height_m", half_height_m)?,
            ),
        };
        let (mut narrow, mut wide) = (narrow.clone(), wide.clone());
        let rolls: Vec<(f64, f64)> = match &config.roll {
            Roll::Fixed(roll) => vec![(*roll, 0.0)],
            Roll::AnyOf(rolls) => rolls.iter().map(|roll| (*roll, 0.0)).collect(),
            Roll::Free if rolls_about_flange(&narrow) => {
                // The last joint alone turns the board: without its limit any roll will do.
                for arm in [&mut narrow, &mut wide] {
                    let mut limits = *arm.limits();
                    limits[6] = JointLimit::FREE;
                    *arm = arm.with_limits(limits)?;
                }
                vec![(0.0, 0.0)]
            }
            Roll::Free => free_arcs(),
        };
        if rolls.is_empty() {
            return Err(ReachabilityError::Empty { what: "rolls" });
        }
        if half_height_m > 0.0 || half_width_m > 0.0 {
            // Else the board's sides are neither level nor upright, and its touched part no
            // rectangle of the wall.
            for (roll, _) in &rolls {
                let quarters = roll / FRAC_PI_2;
                let square = half_height_m == half_width_m;
                let even = if square { 1.0 } else { 2.0 };
                let off = (quarters / even - (quarters / even).round()).abs();
                if off > 1e-9 {
                    return Err(ReachabilityError::Parameter {
                        what: "roll_rad with a touch anywhere on the board",
                        value: *roll,
                        wanted: "a multiple of a quarter turn (of half a turn unless the board is square)",
                    });
                }
            }
        }
        let freedoms = rolls.into_iter().map(|(roll, half_roll)| {
            Ok(Freedom {
                roll: finite("roll_rad", roll)?,
                half_roll,
                half_rise: half_height_m,
            })
        });
        let freedoms: Vec<Freedom> = freedoms.collect::<Result<_, ReachabilityError>>()?;
        let free = |f: &Freedom| f.half_roll > 0.0 || f.half_rise > 0.0;
        if accuracy_m < FINEST_FREE * size && freedoms.iter().any(free) {
            return Err(ReachabilityError::Parameter {
                what: "accuracy_m",
                value: accuracy_m,
                wanted: "at least 5e-7 lengths of the stretched arm where touch or roll are free",
            });
        }
        Ok(Self {
            is_family: narrow != wide,
            narrow,
            wide,
            freedoms,
            accuracy_m,
            half_width_m,
        })
    }

    /// Everything that is reachable of a line.
    ///
    /// # Errors
    /// A line so far away that its points overflow.
    pub fn line(&self, line: &WallLine) -> Result<LineReach, ReachabilityError> {
        // A single arm agrees with itself.
        Ok(self.line_of_family(line, false)?.unwrap_or_default())
    }

    /// As [`line`](Self::line), but `None` where the family's arms differ. With `mirror` only
    /// s ≥ 0 is searched: for arms, tools and rolls that look the same in a mirror.
    pub(crate) fn line_of_family(
        &self,
        line: &WallLine,
        mirror: bool,
    ) -> Result<Option<LineReach>, ReachabilityError> {
        let reach = LineSearch::new(self, line)?.run(mirror);
        Ok(reach.map(|reach| {
            if self.half_width_m > 0.0 {
                reach.dilated(self.half_width_m)
            } else {
                reach
            }
        }))
    }

    /// All branches that provably hold every proven point of a stretch of a line at one roll, and
    /// that roll, rad: the first of those with most branches. None for a free roll of a tilted
    /// tool or a touch anywhere on the board.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn branches_along(
        &self,
        line: &WallLine,
        span: Interval,
    ) -> Result<(f64, BranchSet), ReachabilityError> {
        finite("lo_m", span.lo_m)?;
        finite("hi_m", span.hi_m)?;
        if self.is_free() {
            return Ok((self.first_roll_rad(), BranchSet::EMPTY));
        }
        let mut search = LineSearch::new(self, line)?;
        // Leaves the pieces of the line behind, each proven by itself.
        let _ = search.run(false);
        let (roll, branches) = search.branches_along(span);
        Ok((self.freedoms[roll].roll, branches))
    }

    /// Is there something to choose besides a list of rolls?
    pub(crate) fn is_free(&self) -> bool {
        let free = |f: &Freedom| f.half_roll > 0.0 || f.half_rise > 0.0;
        self.freedoms.iter().any(free)
    }

    /// The verdict at one point of a line.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn is_reachable(&self, line: &WallLine, s_m: f64) -> Result<bool, ReachabilityError> {
        finite("s_m", s_m)?;
        let search = LineSearch::new(self, line)?;
        Ok(search.verdict_within(s_m, self.half_width_m) == Verdict::Reachable)
    }

    /// The arm, its last joint free where the roll is.
    pub(crate) const fn arm(&self) -> &SrsArm {
        &self.narrow
    }

    /// The rolls that it may choose from, rad: middles of arcs for a free roll.
    pub(crate) fn rolls_rad(&self) -> impl Iterator<Item = f64> + '_ {
        self.freedoms.iter().map(|f| f.roll)
    }

    /// The first roll that it was given, rad.
    pub(crate) fn first_roll_rad(&self) -> f64 {
        self.freedoms[0].roll
    }

    /// Accuracy of the ends, m.
    #[must_use]
    pub const fn accuracy_m(&self) -> f64 {
        self.accuracy_m
    }
}

/// A free roll that the last joint cannot make alone is cut into this many arcs to begin with.
const FREE_ARCS: usize = 24;

fn free_arcs() -> Vec<(f64, f64)> {
    let half = PI / FREE_ARCS as f64;
    let arc = |i: usize| ((2 * i + 1) as f64 * half - PI, half);
    (0..FREE_ARCS).map(arc).collect()
}

/// Is the tool's z axis, through the tool point, the axis of the last joint?
fn rolls_about_flange(arm: &SrsArm) -> bool {
    let tool = arm.flange_from_tool();
    let (z, p) = (tool.rotation().z_axis, tool.position_m());
    z.x.hypot(z.y) < 1e-15 && z.z > 0.0 && p.x.hypot(p.y) < 1e-15 * size_m(arm)
}

/// Length of the stretched arm with its tool, m.
pub(crate) fn size_m(arm: &SrsArm) -> f64 {
    let g = arm.geometry();
    g.d_bs_m.abs()
        + g.d_se_m
        + g.d_ew_m
        + g.d_wf_m.abs()
        + arm.flange_from_tool().position_m().length()
}
