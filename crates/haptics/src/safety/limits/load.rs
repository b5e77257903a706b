//! Where on the board a push acts.

use crate::board::Board;
use crate::error::HapticsError;
use hwall_geometry::{Pose, Wrench};
use hwall_numeric::check::{non_negative, positive};

/// Limits of pushes near the edge of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadLimits {
    /// A push closer to the edge of the face than this, or beyond it, counts as a push at the edge, m; default 0.005.
    pub edge_m: f64,
    /// Weaker pushes are not located, N; default 10: noise dominates their centre.
    pub least_n: f64,
    /// Time constant of the filter before a push is located, s; default 0.05. It reduces white noise at 1 kHz by a factor of 10: sensors of 0.1 to
    /// 0.3 N m leave 0.35 N m in the moment, which at 10 N is 35 mm unfiltered.
    pub filter_s: f64,
    /// Largest moment about the centre of the face, N m; default 14: 140 N at the edge of a board of 0.2 m.
    pub moment_n_m: f64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            edge_m: 0.005,
            least_n: 10.0,
            filter_s: 0.05,
            moment_n_m: 14.0,
        }
    }
}

impl LoadLimits {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("edge_m", self.edge_m)?;
        positive("least_n", self.least_n)?;
        non_negative("filter_s", self.filter_s)?;
        positive("moment_n_m", self.moment_n_m)?;
        Ok(())
    }
}

/// A wrench on the board in the frame of its face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardLoad {
    /// Force against the outward normal, N.
    pub normal_n: f64,
    /// Size of the force, N.
    pub force_n: f64,
    /// Size of the tilting moment (about the axes in the face), N m.
    pub moment_n_m: f64,
    /// Point where a single push would cause that moment, x and y of the face, m; infinite or NaN without a normal force.
    pub centre_m: [f64; 2],
}

impl BoardLoad {
    /// The load of a wrench about the centre of the face, base axes.
    #[must_use]
    pub fn new(base_from_board: &Pose, wrench: &Wrench) -> Self {
        let force = base_from_board.inverse_transform_vector(wrench.force_n);
        let moment = base_from_board.inverse_transform_vector(wrench.moment_n_m);
        // r x f = m with r in the face: m_x = y f_z, m_y = -x f_z.
        Self {
            normal_n: -force.z,
            force_n: force.length(),
            moment_n_m: moment.x.hypot(moment.y),
            centre_m: [-moment.y / force.z, moment.x / force.z],
        }
    }

    /// Is this a push at the edge, or too large a moment?
    #[must_use]
    pub fn exceeds(&self, limits: &LoadLimits, board: &Board) -> bool {
        let [x, y] = self.centre_m;
        let inside = x.abs() <= board.half_width_m - limits.edge_m
            && y.abs() <= board.half_height_m - limits.edge_m;
        let at_edge = self.normal_n >= limits.least_n && !inside;
        at_edge || self.moment_n_m > limits.moment_n_m
    }
}
