//! What a search for the base's place is asked for.

use crate::line::Roll;
use crate::steps::Steps;
use std::f64::consts::FRAC_PI_4;

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
    /// default `None`. Walls are no obstacles here, so an arm may well reach a target from the
    /// person's side, around the board. With `Some(0.3)` a target counts only for bases whose
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
