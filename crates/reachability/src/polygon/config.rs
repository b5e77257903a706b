//! What is asked of a region.

use crate::line::Interval;

/// What is asked of a [`WallRegion`](super::WallRegion).
#[derive(Debug, Clone, PartialEq)]
pub struct PolygonConfig {
    /// Hausdorff distance between the polygons' outline and the true one, m; default 1e-4.
    /// Below 1e-8 or above 0.1 arm lengths is an error.
    ///
    /// It is tested at places along the outline, not proven: a thorn with a base narrower than
    /// twenty accuracies that no line meets may be missed, and so is what is thinner than the
    /// accuracy. [`proof_m`](Self::proof_m) bounds how far such parts can reach. On the planes of
    /// the published maps iiwa 7 shows none at 1e-4; of 400 arms with limits narrowed at random 29
    /// showed one, of up to 7 mm, and with `proof_m` at 1e-3 seven, of up to 0.5 mm.
    pub accuracy_m: f64,
    /// Heights to keep, m; default all that the arm reaches.
    pub heights_m: Option<Interval>,
    /// The first lines are no further apart than this, m; default 0.02.
    pub spacing_m: f64,
    /// The plane is proven to be as the polygons say wherever the outline is further away than
    /// this, m; at least ten times the accuracy, else that is taken. Default 0.01; finer takes
    /// longer, `None` trusts the lines and saves two fifths of the time. Where proof and polygons
    /// contradict each other lines are added; [`WallRegion::proof`](super::WallRegion::proof) says what is left.
    pub proof_m: Option<f64>,
}

impl Default for PolygonConfig {
    fn default() -> Self {
        Self {
            accuracy_m: 1e-4,
            heights_m: None,
            spacing_m: 0.02,
            proof_m: Some(0.01),
        }
    }
}
