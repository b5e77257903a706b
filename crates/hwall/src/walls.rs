//! The walls of a scene, as maps of where the arm can present its board.

use crate::error::SessionError;
use hwall_kinematics::SrsArm;
use hwall_reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_scene::Scene;

/// Maps of the vertical surfaces of a scene in the arm's base frame: only their planes and their heights, and only of
/// surfaces within the arm's length. The tool of the arm is the face of the board; any quarter turn of the board counts.
///
/// # Errors
/// As for [`WallMaps::build`].
pub fn maps_of(scene: &Scene, arm: &SrsArm) -> Result<WallMaps, SessionError> {
    let facets: Vec<WallFacet> = scene
        .vertical_facets()
        .into_iter()
        .map(|facet| WallFacet {
            point_m: facet.point_m,
            normal: facet.normal,
            heights: Interval::new(facet.lowest_m, facet.highest_m),
            outline_m: facet.outline_m,
        })
        .collect();
    Ok(WallMaps::build(arm, &facets, WallMapsConfig::default())?)
}
