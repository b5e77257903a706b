//! Where a hand is with its reach, and what that says about the contact.

use super::super::gaussian::Gaussian;
use super::super::stream::ReachBeginning;
use super::phase::ReachPhase;
use crate::estimate::ContactEstimate;
use crate::matrices::isotropic;
use glam::DVec3;
use hwall_hand::{HandState, WatchConfig};

/// Where the hand is with its reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct HandPlace {
    pub(in crate::predict) phase: ReachPhase,
    /// Where it rests, or rested before the reach, m.
    pub(in crate::predict) rest_m: DVec3,
    /// Is it on its way? While it sets off from rest its direction says nothing yet.
    pub(in crate::predict) moves: bool,
    /// Has it set off so fast that its direction says something?
    pub(in crate::predict) is_fast: bool,
}

impl HandPlace {
    /// `began`: how the reach under way did; `stirred_m`: [`StreamEstimator::stirred_m`](super::super::stream::StreamEstimator::stirred_m).
    pub(in crate::predict) fn new(
        hand: &HandState,
        began: Option<&ReachBeginning>,
        stirred_m: f64,
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
            (None, _) if stirred_m >= STIRRED_M => ReachPhase::Stirring,
            (None, _) => ReachPhase::Rest,
        };
        Self {
            phase,
            rest_m: from_m.unwrap_or(hand.point_m),
            moves: matches!(phase, ReachPhase::UnderWay | ReachPhase::End)
                || (phase == ReachPhase::Onset && began.is_some_and(|began| began.turned)),
            is_fast: speed_m_per_s >= FAST_ONSETS * watch.onset_m_per_s,
        }
    }
}

/// A hand that has come further than this since it was last slow stirs, m: the noise of a tracker does not go that far.
const STIRRED_M: f64 = 0.01;

/// A hand this many times as fast as at the onset of a reach has a direction.
const FAST_ONSETS: f64 = 2.0;

/// The Gaussian of an estimate; `default_sd_m` where it states no covariance.
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
    use crate::estimate::TimeToContact;

    #[test]
    fn a_hand_stirs_before_its_reach_is_seen() {
        let mut hand = super::super::resting_at(DVec3::ZERO, 0.0);
        hand.velocity_m_per_s = DVec3::X * 0.2;
        let phase = |stirred_m: f64| {
            HandPlace::new(&hand, None, stirred_m, None, &WatchConfig::default()).phase
        };
        assert_eq!(phase(0.0), ReachPhase::Rest);
        assert_eq!(phase(0.5 * STIRRED_M), ReachPhase::Rest);
        assert_eq!(phase(STIRRED_M), ReachPhase::Stirring);
        assert_eq!(phase(f64::NAN), ReachPhase::Rest);
    }

    #[test]
    fn motion_alone_is_what_came_after_the_start() {
        let estimate = |x: f64, sd_m: f64| ContactEstimate {
            covariance_m2: Some(isotropic(sd_m)),
            time_to_contact_s: Some(TimeToContact {
                mean_s: 0.8,
                sd_s: None,
            }),
            ..ContactEstimate::of_point(0.0, DVec3::X * x)
        };
        let began = ReachBeginning {
            since_s: 0.0,
            place_m: DVec3::ZERO,
            turned: false,
            first_estimate: Some(estimate(0.5, 0.2)),
        };
        let alone = |estimate: &ContactEstimate, began: &ReachBeginning| {
            by_motion_alone(estimate, Some(began), 0.1)
        };
        // 0.5 m within 0.2 m, and then 0.9 m within 0.15 m: together 0.756 m within 0.12 m.
        let [usual, seen] = [0.2_f64, 0.15].map(|sd_m| sd_m.powi(-2));
        let both = estimate(
            (0.5 * usual + 0.9 * seen) / (usual + seen),
            (usual + seen).powf(-0.5),
        );
        let freed = alone(&both, &began).expect("a Gaussian");
        assert!((freed.mean_m.x - 0.9).abs() < 5e-3 && (freed.sd_m() - 0.15).abs() < 5e-3);
        // In the second half of its time a reach shows its way.
        let late = ContactEstimate { t_s: 2.0, ..both };
        let told = alone(&late, &began).expect("a Gaussian");
        assert!((told.sd_m() - 0.12).abs() < 5e-3, "{}", told.sd_m());
        // A reach that turned, one without a start and one without a time are as they are.
        let turned = ReachBeginning {
            turned: true,
            ..began
        };
        assert!(alone(&both, &turned).is_none() && by_motion_alone(&both, None, 0.1).is_none());
        let timeless = ContactEstimate {
            time_to_contact_s: None,
            ..both
        };
        assert!(alone(&timeless, &began).is_none());
    }
}
