//! Settings of the search for a base position by arrival.

use crate::error::ArrivalError;
use crate::target::WeightedTarget;
use crate::waiting::WaitingConfig;
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_numeric::check::{non_negative, within};
use hwall_reachability::{PlacementConfig, Roll, Steps};

/// Candidate positions and the criteria.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrivalPlacementConfig {
    /// Positions and headings. Without [`least_behind_m`](PlacementConfig::least_behind_m) a base must stand behind the walls of its targets: the
    /// board comes from behind.
    pub placement: PlacementConfig,
    /// Settings for finding and evaluating the waiting posture of each position.
    pub waiting: WaitingConfig,
    /// Number of positions evaluated by arrival: those that reach the most targets; default 60.
    pub judged: usize,
    /// Number of the best ones around which positions between the grid points are tried; default 2.
    pub refined: usize,
    /// Least distance of the base column from walls, m; default 0.15.
    pub base_radius_m: f64,
    /// Number of positions to return; default 5.
    pub best: usize,
}

impl ArrivalPlacementConfig {
    /// Default settings for given positions.
    #[must_use]
    pub fn new(placement: PlacementConfig) -> Self {
        Self {
            placement,
            waiting: WaitingConfig::default(),
            judged: 60,
            refined: 2,
            base_radius_m: 0.15,
            best: 5,
        }
    }

    /// Default settings for all positions from which the arm may reach a target, `grid_m` apart, with the base at `base_height_m`: eight headings,
    /// quarter turns of the board.
    ///
    /// # Errors
    /// No targets, NaN or infinity, a grid that is not positive or has too many positions.
    pub fn around(
        arm: &SrsArm,
        targets: &[WeightedTarget],
        grid_m: f64,
        base_height_m: f64,
    ) -> Result<Self, ArrivalError> {
        let points = || targets.iter().map(|t| t.target.point_m);
        let (Some(min), Some(max)) = (points().reduce(DVec3::min), points().reduce(DVec3::max))
        else {
            return Err(ArrivalError::Empty { what: "targets" });
        };
        let far_m = arm.shoulder_wrist_range().longest_m + 0.2;
        let x = Steps::spanning(min.x - far_m, max.x + far_m, grid_m)?;
        let y = Steps::spanning(min.y - far_m, max.y + far_m, grid_m)?;
        Ok(Self::new(PlacementConfig {
            roll: Roll::quarter_turns(),
            ..PlacementConfig::new(x, y, base_height_m)
        }))
    }

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is always outside.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        self.waiting.validate()?;
        non_negative("base_radius_m", self.base_radius_m)?;
        for (what, count) in [("judged", self.judged), ("best", self.best)] {
            within(what, count as f64, 1.0..=1e5, "between 1 and 100000")?;
        }
        Ok(())
    }
}
