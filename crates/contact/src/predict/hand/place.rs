//! The phase of the hand, its rest position, and the distribution of an estimate.

use super::super::gaussian::Gaussian;
use super::super::stream::ReachBeginning;
use super::phase::ReachPhase;
use crate::estimate::ContactEstimate;
use crate::matrices::isotropic;
use glam::DVec3;
use hwall_hand::{HandState, WatchConfig};

/// The phase and rest position of a hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct HandPlace {
    pub(in crate::predict) phase: ReachPhase,
    /// Position of the present rest, or of the rest before the reach, m.
    pub(in crate::predict) rest_m: DVec3,
}

impl HandPlace {
    /// `began`: beginning of the present reach; `drifted_m`: [`StreamEstimator::drifted_m`](super::super::stream::StreamEstimator::drifted_m).
    pub(in crate::predict) fn new(
        hand: &HandState,
        began: Option<&ReachBeginning>,
        drifted_m: f64,
        estimate: Option<&ContactEstimate>,
        watch: &WatchConfig,
    ) -> Self {
        let speed_m_per_s = hand.velocity_m_per_s.length();
        let slow = speed_m_per_s < watch.offset_m_per_s;
        let from_m = began.filter(|_| !slow).map(|began| began.place_m);
        let phase = match (estimate, began) {
            (Some(estimate), Some(began)) => {
                let left_s = estimate.time_to_contact_s.map(|time| time.mean_s);
                ReachPhase::of(hand.point_m.distance(began.place_m), left_s)
            }
            (Some(_), None) => ReachPhase::Onset,
            (None, _) if drifted_m >= DRIFTED_M => ReachPhase::Drifting,
            (None, _) => ReachPhase::Rest,
        };
        Self {
            phase,
            rest_m: from_m.unwrap_or(hand.point_m),
        }
    }
}

/// A hand that has moved further than this since it was last slow starts to move, m: above tracker noise.
const DRIFTED_M: f64 = 0.01;

/// The Gaussian of an estimate; `default_sd_m` applies without a covariance.
pub(in crate::predict) fn gaussian_of(
    estimate: &ContactEstimate,
    default_sd_m: f64,
) -> Option<Gaussian> {
    let covariance_m2 = estimate.covariance_m2;
    Gaussian::new(
        estimate.point_m,
        covariance_m2.unwrap_or(isotropic(default_sd_m)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_drifts_before_its_reach_is_seen() {
        let mut hand = super::super::resting_at(DVec3::ZERO, 0.0);
        hand.velocity_m_per_s = DVec3::X * 0.2;
        let phase = |drifted_m: f64| {
            HandPlace::new(&hand, None, drifted_m, None, &WatchConfig::default()).phase
        };
        assert_eq!(phase(0.0), ReachPhase::Rest);
        assert_eq!(phase(0.5 * DRIFTED_M), ReachPhase::Rest);
        assert_eq!(phase(DRIFTED_M), ReachPhase::Drifting);
        assert_eq!(phase(f64::NAN), ReachPhase::Rest);
    }
}
