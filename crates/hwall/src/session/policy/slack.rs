//! How much of the face is slack.

use super::config::SlackConfig;
use hwall_contact::ContactPrediction;
use hwall_haptics::{Board, PlaceTolerance, surface_axes};

impl SlackConfig {
    /// How far the middle of the board may be from a touch on its face, m. At any roll, the face covers at least the disc about its middle.
    pub(in crate::session) fn reach_m(&self, board: &Board, place: &PlaceTolerance) -> f64 {
        let half_m = board.half_width_m.min(board.half_height_m);
        half_m - place.inset_m - self.margin_m
    }

    /// Standard deviations of a predicted point along the axes of its surface, m; NaN for an invalid covariance.
    pub(super) fn sds_m(&self, contact: &ContactPrediction) -> [f64; 2] {
        let Ok(axes) = surface_axes(contact.normal) else {
            return [f64::NAN; 2];
        };
        axes.map(|axis| match contact.covariance_m2 {
            Some(c) => (c * axis).dot(axis).sqrt(),
            None => self.default_sd_m,
        })
    }

    /// How far the middle of the board may be from a predicted point along the axes of the surface, m: half axes of an ellipse.
    pub(in crate::session) fn slack_m(
        &self,
        contact: &ContactPrediction,
        board: &Board,
        place: &PlaceTolerance,
    ) -> [f64; 2] {
        let reach_m = self.reach_m(board, place);
        // NaN counts as no slack.
        self.sds_m(contact)
            .map(|sd_m| (reach_m - self.deviations * sd_m).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use hwall_scene::SurfaceId;

    #[test]
    fn what_is_known_of_a_point_is_the_slack_and_nan_is_none() {
        let slack_m = |covariance_m2: Option<DMat3>| {
            let contact = ContactPrediction {
                covariance_m2,
                ..ContactPrediction::of_place(SurfaceId(0), DVec3::X, DVec3::X)
            };
            let (board, place) = (Board::default(), PlaceTolerance::default());
            SlackConfig::default().slack_m(&contact, &board, &place)[0]
        };
        let of = |variance_m2: f64| slack_m(Some(DMat3::from_diagonal(DVec3::splat(variance_m2))));
        // Half a face less 20 mm of inset, 5 mm of margin and one standard deviation.
        assert!((of(0.0) - 0.075).abs() < 1e-12);
        assert!((of(0.03_f64.powi(2)) - 0.045).abs() < 1e-12);
        assert!((slack_m(None) - 0.055).abs() < 1e-12);
        assert_eq!([of(1.0), of(f64::NAN), of(-1.0)], [0.0; 3]);
    }
}
