//! Touches in numbers.

use crate::environment::outcome::{OutOfReach, Outcome, Touch};
use crate::report::quantiles;

/// Touches in numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Summary {
    pub(super) all: usize,
    pub(super) in_reach: usize,
    pub(super) in_time: usize,
    /// Also parallel to the wall within 2 degrees.
    pub(super) in_time_parallel: usize,
    /// In the order of [`OutOfReach::NAMES`].
    pub(super) reasons: [usize; 8],
    /// Median, 90 % and largest angle between board and wall of those within reach, degrees.
    pub(super) residual_deg: [f64; 3],
    /// The same of the angle by which the avatar had been turned.
    pub(super) turned_deg: [f64; 3],
    /// Median and 10 % of the time for the arm's way, median of its least time, s.
    pub(super) budget_s: [f64; 2],
    pub(super) travel_s: f64,
    /// Shifts that brought a touch in time: from late, from out of reach.
    pub(super) from_late: usize,
    pub(super) from_out_of_reach: usize,
    /// Median, 90 % and largest shift, mm.
    pub(super) shift_mm: [f64; 3],
    /// Median and largest angle of the shift, degrees: the larger of both.
    pub(super) shift_deg: [f64; 2],
    /// Least and largest gain.
    pub(super) gain: [f64; 2],
    /// Median share of the travel time that the best shift saves, of those late without.
    pub(super) saved: f64,
}

/// A board within this of the wall's heading is parallel to it, rad: as in the judgement of the main job.
const PARALLEL_RAD: f64 = 0.035;

impl Summary {
    pub(super) fn new(touches: &[Touch]) -> Self {
        let mut reasons = [0; 8];
        for touch in touches {
            if let Outcome::OutOfReach(reason) = touch.outcome {
                let name = reason.name();
                if let Some(at) = OutOfReach::NAMES.iter().position(|n| *n == name) {
                    reasons[at] += 1;
                }
            }
        }
        let in_reach: Vec<&Touch> = touches
            .iter()
            .filter(|t| !matches!(t.outcome, Outcome::OutOfReach(_)))
            .collect();
        let in_time = || touches.iter().filter(|t| t.outcome == Outcome::InTime);
        let parallel = |t: &&Touch| t.residual_rad.abs() <= PARALLEL_RAD;
        let degrees = |angle: f64| angle.abs().to_degrees();
        let residual = quantiles(
            in_reach.iter().map(|t| degrees(t.residual_rad)),
            [0.5, 0.9, 1.0],
        );
        let turned = quantiles(
            touches.iter().map(|t| degrees(t.turned_rad)),
            [0.5, 0.9, 1.0],
        );
        let used = || touches.iter().filter_map(|t| Some((t, t.used?)));
        // A touch that was late without a shift has a travel time without.
        let late = |t: &Touch| t.shortest_s.is_some();
        let gains = quantiles(used().map(|(_, u)| u.shift.gain), [0.0, 1.0]);
        let saved = touches
            .iter()
            .filter_map(|t| t.shortest_s.map(|[with, without]| 1.0 - with / without));
        Self {
            all: touches.len(),
            in_reach: in_reach.len(),
            in_time: in_time().count(),
            in_time_parallel: in_time().filter(parallel).count(),
            reasons,
            residual_deg: residual,
            turned_deg: turned,
            budget_s: quantiles(touches.iter().map(|t| t.budget_s), [0.5, 0.1]),
            travel_s: quantiles(in_reach.iter().filter_map(|t| t.travel_s), [0.5])[0],
            from_late: used().filter(|(t, _)| late(t)).count(),
            from_out_of_reach: used().filter(|(t, _)| !late(t)).count(),
            shift_mm: quantiles(used().map(|(_, u)| 1e3 * u.offset_m), [0.5, 0.9, 1.0]),
            shift_deg: quantiles(
                used().map(|(_, u)| {
                    degrees(u.shift.horizontal_rad).max(degrees(u.shift.vertical_rad))
                }),
                [0.5, 1.0],
            ),
            gain: gains,
            saved: quantiles(saved, [0.5])[0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_kinematics::Unreachable;

    #[test]
    fn every_touch_is_counted_once_and_nothing_is_no_number() {
        let none = Summary::new(&[]);
        assert!(none.all == 0 && none.residual_deg[0].is_nan() && none.saved.is_nan());
        let touch = |outcome| Touch {
            outcome,
            point_m: DVec3::ZERO,
            normal: DVec3::X,
            residual_rad: 0.1,
            turned_rad: 0.0,
            budget_s: 0.7,
            travel_s: Some(0.5),
            used: None,
            shortest_s: None,
        };
        let reasons = [
            OutOfReach::NotSampled { beyond_rad: 0.1 },
            OutOfReach::ArmBeforeWall { behind_m: 0.0 },
            OutOfReach::Arm(Unreachable::TooFar { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::TooNear { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::ElbowLimit { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::ShoulderLimit),
            OutOfReach::Arm(Unreachable::WristLimit),
            OutOfReach::Arm(Unreachable::ArmAngleConflict),
        ];
        let mut touches: Vec<Touch> = reasons.map(|r| touch(Outcome::OutOfReach(r))).to_vec();
        touches.extend([touch(Outcome::Late), touch(Outcome::InTime)]);
        let summary = Summary::new(&touches);
        assert_eq!(summary.reasons, [1; 8]);
        assert_eq!(
            (
                summary.all,
                summary.in_reach,
                summary.in_time,
                summary.in_time_parallel
            ),
            (10, 2, 1, 0)
        );
    }
}
