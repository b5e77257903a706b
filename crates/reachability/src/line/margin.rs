//! How far a board may be displaced with the pose still reachable: a proven lower bound.
//!
//! While presented, a board is kept this far inside the reachable set, because hand tracking and contact
//! prediction have errors. One region test ([`SrsArm::region_verdict`]) proves a whole ball of positions
//! and cone of orientations; bisection finds the largest size that passes. The true margin is larger.

use super::family::size_m;
use crate::error::Result;
use hwall_kinematics::{Pose, PoseRegion, RegionVerdict, SrsArm};
use hwall_numeric::check::non_negative;

/// Sizes are found to within this factor.
const RESOLUTION: f64 = 1.02;

/// Margins below this fraction of the arm's length (or this angle, rad) count as none.
const SMALLEST: f64 = 1e-9;

/// The largest radius (m) of a ball of positions around `base_from_tool` that is proven reachable with any
/// orientation within `cone_rad`. `None` if nothing is proven: the pose is unreachable or too close to the boundary.
///
/// The largest size that a single region test proves, to 2 %; covering the ball with smaller ones would give a larger bound.
///
/// # Errors
/// NaN, infinite or negative angles.
pub fn position_margin_m(
    arm: &SrsArm,
    base_from_tool: &Pose,
    cone_rad: f64,
) -> Result<Option<f64>> {
    non_negative("cone_rad", cone_rad)?;
    let size = size_m(arm);
    let largest = largest_proven(0.05, |share| {
        let region = PoseRegion::ball(*base_from_tool, share * size, cone_rad);
        matches!(arm.region_verdict(&region), RegionVerdict::Reachable(_))
    });
    Ok(largest.map(|share| share * size))
}

/// The largest angle (rad) of a cone of orientations around that of `base_from_tool` that is proven
/// reachable at any position within `radius_m`. `None` if nothing is proven.
///
/// # Errors
/// NaN, infinite or negative radii.
pub fn orientation_margin_rad(
    arm: &SrsArm,
    base_from_tool: &Pose,
    radius_m: f64,
) -> Result<Option<f64>> {
    non_negative("radius_m", radius_m)?;
    Ok(largest_proven(0.1, |angle_rad| {
        let region = PoseRegion::ball(*base_from_tool, radius_m, angle_rad);
        matches!(arm.region_verdict(&region), RegionVerdict::Reachable(_))
    }))
}

/// The largest size for which `holds` is true, to [`RESOLUTION`], from a first guess.
fn largest_proven(guess: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut inside, mut outside) = (guess, guess);
    if holds(guess) {
        loop {
            outside = 2.0 * inside;
            if outside > 2.0 || !holds(outside) {
                break;
            }
            inside = outside;
        }
    } else {
        loop {
            inside = 0.25 * outside;
            if inside < SMALLEST {
                return None;
            }
            if holds(inside) {
                break;
            }
            outside = inside;
        }
    }
    while outside > RESOLUTION * inside {
        let middle = (inside * outside).sqrt();
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Some(inside)
}
