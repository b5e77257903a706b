//! Where to put the base: candidate positions scored by the number of contact targets reached.
//!
//! Each pose is first tested with joint 1 unlimited. If it is unreachable then, it is unreachable at
//! every heading. Otherwise the configuration found is valid for each heading at which its joint 1 is
//! within the limit, and only the other headings are tested again. All headings together therefore
//! cost little more than one.

use super::config::PlacementConfig;
use super::problem::PlacementProblem;
use super::scores::PlacementScores;
use super::search;
use super::size_limits::{MOST_BOARDS, MOST_CANDIDATES, MOST_HEADINGS, refuse_above};
use super::target::Target;
use crate::error::{ReachabilityError, Result};
use crate::line::Roll;
use crate::progress::{map_indexed, silent};
use hwall_kinematics::SrsArm;
use hwall_numeric::check::finite;

/// Scores every position and heading, and finds the best.
///
/// A target is reached if the arm can hold the board there (exact verdict, tool z axis along the
/// normal) at any of the rolls. Obstacles, including the arm's own body, are ignored. If positions tie
/// for the last ranks, their worst margins decide, by branch and bound; margins of other positions are
/// not computed. The result does not depend on the number of threads.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{Interval, PlacementConfig, Steps, Target, place_base};
///
/// // A wall 1 m wide at x = 2 m, the person on its far side.
/// let wall = DVec3::new(2.0, 0.0, 0.0);
/// let targets = Target::on_wall(wall, DVec3::X, 1.0, Interval::new(0.9, 1.5), 0.25)?;
/// let x = Steps::spanning(0.9, 1.9, 0.1)?;
/// let y = Steps::spanning(-0.5, 0.5, 0.1)?;
/// let scores = place_base(&SrsArm::iiwa7(), &targets, &PlacementConfig::new(x, y, 0.8))?;
/// let best = scores.best()[0];
/// assert_eq!(best.reachable, targets.len());
/// assert!(best.worst_margin_m > Some(0.02) && best.room_from_base.position_m().y.abs() < 1e-9);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
///
/// # Errors
/// No targets, headings or rolls, NaN or infinity, normals that are zero or not horizontal, too many candidates or targets.
pub fn place_base(
    arm: &SrsArm,
    targets: &[Target],
    config: &PlacementConfig,
) -> Result<PlacementScores> {
    check(targets, config)?;
    let problem = PlacementProblem::new(arm, targets, config)?;
    let columns = config.x.count();
    let positions = columns * config.y.count();
    let counts = map_indexed(positions, &silent, |position| problem.score(position))?.concat();
    let best = search::best(&problem, &counts)?;
    Ok(PlacementScores {
        config: config.clone(),
        total: targets.len(),
        counts,
        best,
    })
}

/// Rejects invalid or too large requests before allocating anything.
fn check(targets: &[Target], config: &PlacementConfig) -> Result<()> {
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
