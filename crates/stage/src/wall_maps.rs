//! Reachability maps of a scene's own walls, for the run time of the main job.

use glam::DVec3;
use hwall_kinematics::SrsArm;
pub use hwall_reachability::Presented;
use hwall_reachability::{Interval, WallFacet, WallMapsConfig};
use hwall_scene::Scene;
use std::time::{Duration, Instant};

/// The maps of all walls that the arm could reach at all.
pub struct WallMaps {
    maps: hwall_reachability::WallMaps,
    /// How long they took.
    pub took: Duration,
}

impl WallMaps {
    /// Maps of the scene's vertical surfaces, see [`hwall_reachability::WallMaps::build`].
    ///
    /// # Errors
    /// More lines than a map holds.
    pub fn of_scene(arm: &SrsArm, scene: &Scene) -> anyhow::Result<Self> {
        let start = Instant::now();
        let patches = scene.vertical_patches().into_iter();
        let facets: Vec<WallFacet> = patches
            .map(|patch| WallFacet {
                point_m: patch.point_m,
                normal: patch.normal,
                heights: Interval::new(patch.height_range_m.0, patch.height_range_m.1),
                outline_m: patch.outline_m,
            })
            .collect();
        let config = WallMapsConfig::default();
        let maps = hwall_reachability::WallMaps::build(arm, &facets, config)?;
        Ok(Self {
            maps,
            took: start.elapsed(),
        })
    }

    /// How many walls and lines.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        self.maps
            .map()
            .map_or((0, 0), |map| (map.walls().len(), map.report().lines))
    }

    /// Looks a predicted contact up.
    #[must_use]
    pub fn present(&self, point_m: DVec3, normal: DVec3) -> Presented {
        self.maps.present(point_m, normal)
    }

    /// Reachable stretches of all lines, ends in the base frame, m; for drawing.
    #[must_use]
    pub fn stretches(&self) -> Vec<[DVec3; 2]> {
        self.maps.stretches()
    }
}
