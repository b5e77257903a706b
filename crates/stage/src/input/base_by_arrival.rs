//! Where the base of the arm stands best for touches in a scene.

use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use anyhow::{Context, bail};
use hwall::arrival::reachability::{PlacementConfig, Steps};
use hwall::arrival::{ArrivalPlacementConfig, BoardExtent, place_base_by_arrival};
use hwall::haptics::Board;
use hwall::scene::Scene;
use hwall::{LikelyTouches, facets_of};
use hwall_motion::{MotionConfig, MotionLimits};

/// How far the base may be moved from the origin of the scene along each axis, m, and in which steps, m.
const RANGE_M: f64 = 0.2;
const STEP_M: f64 = 0.1;
const STEPS: usize = 5;
/// And turned, degrees.
const HEADINGS_DEG: [f64; 3] = [-15.0, 0.0, 15.0];

/// The place near the origin of the scene from which most of the touches are reached in time, all in the frame of the scene.
///
/// # Errors
/// An arm without a closed form, a scene without walls, nothing within reach from anywhere.
pub fn base_by_arrival(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    touches: &LikelyTouches,
) -> anyhow::Result<FloorPose> {
    let srs = arm
        .closed_form()
        .context("--base-from arrival: needs an arm with a closed form, such as iiwa7")?;
    let LikelyTouches::Such(targets) = touches else {
        bail!("--base-from arrival: nobody can touch a wall of this scene");
    };
    let steps = Steps::new(-RANGE_M, STEP_M, STEPS)?;
    let extent = BoardExtent {
        half_width_m: board.half_width_m,
        half_height_m: board.half_height_m,
    };
    let limits = MotionLimits::of_arm(srs, &MotionConfig::default())?;
    let config = ArrivalPlacementConfig::new(PlacementConfig {
        headings_rad: HEADINGS_DEG.map(f64::to_radians).to_vec(),
        ..PlacementConfig::new(steps, steps, 0.0)
    });
    let found = place_base_by_arrival(srs, targets, &facets_of(scene), extent, &limits, &config)?;
    let best = found
        .best
        .first()
        .context("--base-from arrival: no place for the base")?;
    Ok(FloorPose {
        origin_m: best.room_from_base.position_m(),
        yaw_rad: best.heading_rad,
    })
}
