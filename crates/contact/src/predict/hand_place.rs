//! Where a hand is with its reach, and what that says about the contact.

use super::gaussian::Gaussian;
use super::look_shares::ReachPhase;
use crate::estimate::ContactEstimate;
use glam::{DMat3, DVec3};
use hwall_hand::{HandState, WatchConfig};

/// Where the hand is with its reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HandPlace {
    pub(super) phase: ReachPhase,
    /// Where it rests, or rested before the reach, m.
    pub(super) rest_m: DVec3,
    /// Is it on its way? Before that its direction says nothing.
    pub(super) moves: bool,
}

impl HandPlace {
    /// `began_m`: where the reach under way began.
    pub(super) fn new(
        hand: &HandState,
        began_m: Option<DVec3>,
        estimate: Option<&ContactEstimate>,
        watch: &WatchConfig,
    ) -> Self {
        let speed_m_per_s = hand.velocity_m_per_s.length();
        let slow = speed_m_per_s < watch.offset_m_per_s;
        let rest_m = began_m.filter(|_| !slow).unwrap_or(hand.point_m);
        let phase = match (estimate, began_m) {
            (Some(estimate), Some(began_m)) => {
                let left_s = estimate.time_to_contact_s.map(|time| time.mean_s);
                ReachPhase::of(hand.point_m.distance(began_m), left_s)
            }
            (Some(_), None) => ReachPhase::Onset,
            (None, _) => ReachPhase::Rest,
        };
        Self {
            phase,
            rest_m,
            moves: matches!(phase, ReachPhase::UnderWay | ReachPhase::End),
        }
    }
}

/// The Gaussian of an estimate; `default_sd_m` where it states no covariance.
pub(super) fn gaussian_of(estimate: &ContactEstimate, default_sd_m: f64) -> Option<Gaussian> {
    let ball = DMat3::from_diagonal(DVec3::splat(default_sd_m * default_sd_m));
    Gaussian::new(estimate.point_m, estimate.covariance_m2.unwrap_or(ball))
}

/// What a hand can reach from here, m: an arm's length and a step are two standard deviations.
const NEAR_SD_M: f64 = 0.6;

/// Anywhere near.
pub(super) fn near(hand_m: DVec3) -> Option<Gaussian> {
    let ball = DMat3::from_diagonal(DVec3::splat(NEAR_SD_M * NEAR_SD_M));
    Gaussian::new(hand_m, ball)
}
