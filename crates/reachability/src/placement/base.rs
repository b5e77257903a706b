//! Where to put the base: candidate places scored by how many contact targets they reach.
//!
//! A pose is asked once with joint 1 free. What is then out of reach is so at every heading, and a
//! configuration found then serves each heading whose limit its joint 1 keeps; the verdict is asked
//! again only for the other headings. So all headings together cost little more than one.

use super::problem::Scene;
use super::search as placement_search;
use crate::error::finite;
use crate::progress::{Monitor, Progress, map_indexed};
use crate::{ReachabilityError, Roll, Steps, WallPlane};
use glam::{DMat3, DVec3};
use hwall_kinematics::{Pose, SrsArm};
use std::f64::consts::FRAC_PI_4;
use std::ops::ControlFlow;

/// More pairs of position and heading than this (64 megabytes of scores) are refused.
const MOST_CANDIDATES: u128 = 1 << 24;

/// More boards (targets times rolls) than this, half a gigabyte, are refused.
const MOST_BOARDS: u128 = 1 << 22;

/// More headings than this, ten to a degree, are refused.
const MOST_HEADINGS: u128 = 3600;

/// A place where the board shall be touched: its middle and the wall's normal, room frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The board's middle (the tool point), m; z is up.
    pub point_m: DVec3,
    /// Normal of the wall towards the person, horizontal (a lean up to 1 degree is dropped), of
    /// any length but zero.
    pub normal: DVec3,
}

impl Target {
    /// Targets all over a rectangle of a wall, row by row, borders included: as far apart as they
    /// can be evenly, `spacing_m` at most.
    ///
    /// `middle_m` is halfway along the wall (its z is not used), `normal` points towards the
    /// person, `heights_m` are those of the lower and upper border; room frame. A width or height
    /// of zero gives a single column or row.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is not horizontal, a negative width, a spacing that is not
    /// positive, or more targets than fit.
    pub fn on_wall(
        middle_m: DVec3,
        normal: DVec3,
        width_m: f64,
        heights_m: (f64, f64),
        spacing_m: f64,
    ) -> Result<Vec<Self>, ReachabilityError> {
        let plane = WallPlane::through(middle_m, normal)?;
        crate::error::non_negative("width_m", width_m)?;
        crate::error::positive("spacing_m", spacing_m)?;
        let (low, high) = heights_m;
        let height = finite("upper border", high)? - finite("lower border", low)?;
        let intervals = |extent: f64| {
            // A last interval that is too long by rounding counts as one.
            finite("extent in steps", extent.abs() / spacing_m).map(|n| (n - 1e-9).ceil().max(0.0))
        };
        let (across, up) = (intervals(width_m)?, intervals(height)?);
        let lines = |n: f64| (n as u128).saturating_add(1);
        let count = lines(across).saturating_mul(lines(up));
        refuse_above(MOST_BOARDS, "targets", count)?;
        // From the middle, -1/2 to 1/2; a single one in the middle.
        let share = |i: u32, n: f64| if n > 0.0 { f64::from(i) / n - 0.5 } else { 0.0 };
        let mut targets = Vec::with_capacity(count as usize);
        for row in 0..=up as u32 {
            let z = 0.5 * (low + high) + height * share(row, up);
            for column in 0..=across as u32 {
                let side = plane.along() * (width_m * share(column, across));
                targets.push(Self {
                    point_m: DVec3::new(middle_m.x + side.x, middle_m.y + side.y, z),
                    normal: plane.normal(),
                });
            }
        }
        Ok(targets)
    }
}

/// Which places to try, and what counts as reached.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacementConfig {
    /// Positions of the base along the room's x axis, m.
    pub x: Steps,
    /// Positions along y, m.
    pub y: Steps,
    /// Height of the base (floor or pedestal) in the room, m.
    pub z_m: f64,
    /// Headings of the base, rad: its x axis is the room's turned by this about the vertical.
    pub headings_rad: Vec<f64>,
    /// How the board may be turned about the normal; default fixed at 0.
    pub roll: Roll,
    /// How many positions to return with margins; default 10. Each costs about 1 ms for 100
    /// targets.
    pub best: usize,
    /// Least distance of the base's axis behind the wall of each target that it serves, m;
    /// default `None`. The wall has no substance, so an arm may well reach a target from the
    /// person's side, round the board. With `Some(0.3)` a target counts only for bases whose
    /// `normal · (point - base)` is at least 0.3 m.
    pub least_behind_m: Option<f64>,
}

impl PlacementConfig {
    /// Eight headings, the ten best, no rule about sides.
    #[must_use]
    pub fn new(x: Steps, y: Steps, z_m: f64) -> Self {
        Self {
            x,
            y,
            z_m,
            headings_rad: (0..8).map(|i| f64::from(i) * FRAC_PI_4).collect(),
            roll: Roll::Fixed(0.0),
            best: 10,
            least_behind_m: None,
        }
    }
}

/// One place for the base, and what it is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The base's axis in the room, m.
    pub x_m: f64,
    /// The same, along y, m.
    pub y_m: f64,
    /// Height of the base in the room, m.
    pub z_m: f64,
    /// Turn of the base about the vertical, rad.
    pub heading_rad: f64,
    /// Targets reached.
    pub reachable: usize,
    /// Targets in all.
    pub total: usize,
    /// Least margin ([`position_margin_m`](crate::position_margin_m), at the roll that has most)
    /// of the targets reached, m: zero if one of them has none that is proven, `None` where no
    /// target is reached.
    pub worst_margin_m: Option<f64>,
    /// Mean margin of the targets reached, m.
    pub mean_margin_m: Option<f64>,
}

impl Placement {
    /// Share of the targets reached, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.reachable as f64 / self.total as f64
    }

    /// The base frame in the room.
    ///
    /// # Errors
    /// NaN or infinity, which [`place_base`] never returns.
    pub fn room_from_base(&self) -> Result<Pose, ReachabilityError> {
        let position = DVec3::new(self.x_m, self.y_m, self.z_m);
        Ok(Pose::new(
            DMat3::from_rotation_z(self.heading_rad),
            position,
        )?)
    }
}

/// The best of a position's headings, for a heat map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacementCell {
    /// The first of the headings that reach most targets, rad.
    pub heading_rad: f64,
    /// Targets reached with it.
    pub reachable: usize,
}

/// Scores of all candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacementScores {
    config: PlacementConfig,
    total: usize,
    /// Row by row (y), position by position (x), heading by heading.
    counts: Vec<u32>,
    best: Vec<Placement>,
}

impl PlacementScores {
    /// The best positions, each at its best heading: by targets reached, then by the worst
    /// margin, then in the order of the grid (x fastest).
    #[must_use]
    pub fn best(&self) -> &[Placement] {
        &self.best
    }

    /// What was asked for.
    #[must_use]
    pub const fn config(&self) -> &PlacementConfig {
        &self.config
    }

    /// Targets in all.
    #[must_use]
    pub const fn total(&self) -> usize {
        self.total
    }

    /// Targets reached from position `(ix, iy)` at a heading's index; `None` outside the grid.
    #[must_use]
    pub fn reachable(&self, ix: usize, iy: usize, heading: usize) -> Option<usize> {
        self.of_position(ix, iy)?.get(heading).map(|&n| n as usize)
    }

    /// The best that position `(ix, iy)` gives; `None` outside the grid.
    #[must_use]
    pub fn cell(&self, ix: usize, iy: usize) -> Option<PlacementCell> {
        let counts = self.of_position(ix, iy)?;
        let reachable = most(counts);
        let heading = counts.iter().position(|&n| n == reachable)?;
        Some(PlacementCell {
            heading_rad: self.config.headings_rad[heading],
            reachable: reachable as usize,
        })
    }

    /// The heat map: the largest share of targets, 0 to 1, of each position; as many values as `x`
    /// has, then the next of `y`.
    #[must_use]
    pub fn shares(&self) -> Vec<f64> {
        let positions = self.counts.chunks_exact(self.config.headings_rad.len());
        let share = |counts| f64::from(most(counts)) / self.total as f64;
        positions.map(share).collect()
    }

    fn of_position(&self, ix: usize, iy: usize) -> Option<&[u32]> {
        let (columns, rows) = (self.config.x.count(), self.config.y.count());
        if ix >= columns || iy >= rows {
            return None;
        }
        let headings = self.config.headings_rad.len();
        Some(&self.counts[(iy * columns + ix) * headings..][..headings])
    }
}

/// The largest of a position's counts.
pub(crate) fn most(counts: &[u32]) -> u32 {
    counts.iter().copied().max().unwrap_or(0)
}

/// Scores every position and heading, and finds the best.
///
/// A target is reached if the arm can hold the board there by the exact verdict, at any of the
/// rolls: with the tool's z axis along the normal. Obstacles, the arm's own body among them, do
/// not count. Of all positions that tie for the last places the worst margins decide, by
/// branch and bound; other positions' margins are never computed. The result does not depend on
/// the number of threads.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{PlacementConfig, Steps, Target, place_base};
///
/// // A wall 1 m wide at x = 2 m, the person on its far side.
/// let wall = DVec3::new(2.0, 0.0, 0.0);
/// let targets = Target::on_wall(wall, DVec3::X, 1.0, (0.9, 1.5), 0.25)?;
/// let x = Steps::spanning(0.9, 1.9, 0.1)?;
/// let y = Steps::spanning(-0.5, 0.5, 0.1)?;
/// let scores = place_base(&SrsArm::iiwa7(), &targets, &PlacementConfig::new(x, y, 0.8))?;
/// let best = scores.best()[0];
/// assert_eq!(best.reachable, targets.len());
/// assert!(best.worst_margin_m > Some(0.02) && best.y_m.abs() < 1e-9);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
///
/// # Errors
/// No targets, headings or rolls, NaN or infinity, normals without direction or that are not
/// horizontal, more candidates or targets than fit.
pub fn place_base(
    arm: &SrsArm,
    targets: &[Target],
    config: &PlacementConfig,
) -> Result<PlacementScores, ReachabilityError> {
    place_base_monitored(arm, targets, config, &|_: Progress| {
        ControlFlow::Continue(())
    })
}

/// As [`place_base`], telling how far it is: first the positions scored, then those searched for
/// the best margins; the monitor can cancel it.
///
/// # Errors
/// As [`place_base`], or [`ReachabilityError::Cancelled`].
pub fn place_base_monitored(
    arm: &SrsArm,
    targets: &[Target],
    config: &PlacementConfig,
    monitor: &Monitor,
) -> Result<PlacementScores, ReachabilityError> {
    check(targets, config)?;
    let scene = Scene::new(arm, targets, config)?;
    let columns = config.x.count();
    let positions = columns * config.y.count();
    let counts = map_indexed(positions, monitor, |position| scene.score(position))?.concat();
    let best = placement_search::best(&scene, &counts, monitor)?;
    Ok(PlacementScores {
        config: config.clone(),
        total: targets.len(),
        counts,
        best,
    })
}

/// Rejects what makes no sense or does not fit, before anything is allocated for it.
fn check(targets: &[Target], config: &PlacementConfig) -> Result<(), ReachabilityError> {
    for (what, is_empty) in [
        ("targets", targets.is_empty()),
        ("headings", config.headings_rad.is_empty()),
    ] {
        if is_empty {
            return Err(ReachabilityError::Empty { what });
        }
    }
    let headings = config.headings_rad.len() as u128;
    refuse_above(MOST_HEADINGS, "headings", headings)?;
    let positions = config.x.count() as u128 * config.y.count() as u128;
    refuse_above(MOST_CANDIDATES, "candidates", positions * headings)?;
    let rolls = match &config.roll {
        Roll::AnyOf(rolls) => rolls.len(),
        Roll::Fixed(_) | Roll::Free => 1,
    };
    let boards = targets.len() as u128 * rolls as u128;
    refuse_above(MOST_BOARDS, "boards", boards)?;
    finite("z_m", config.z_m)?;
    if let Some(distance) = config.least_behind_m {
        finite("least_behind_m", distance)?;
    }
    for heading in &config.headings_rad {
        finite("heading_rad", *heading)?;
    }
    Ok(())
}

fn refuse_above(limit: u128, what: &'static str, count: u128) -> Result<(), ReachabilityError> {
    if count > limit {
        return Err(ReachabilityError::TooMany { what, count, limit });
    }
    Ok(())
}
