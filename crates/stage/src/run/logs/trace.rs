//! Data of a run for the figures.

use crate::person::predictors::{PREDICTORS, PredictionRecord};
use crate::run::evaluation::judge::Outcome;
use crate::run::logs::snapshots::{BoardFace, Snapshot};
use glam::DVec3;

/// Time, s, and place, m.
pub type TimedPoint = (f64, DVec3);

/// Data of a run for the figures.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Filtered hand over time, with gaps where it was lost.
    pub hand_m: Vec<TimedPoint>,
    /// Middle of the board's face.
    pub board_m: Vec<TimedPoint>,
    /// Predicted contact points, in the order of
    /// [`PredictorKind::ALL`](crate::person::predictors::PredictorKind::ALL).
    pub predicted_m: [Vec<DVec3>; PREDICTORS],
    /// Time, and distance of the predicted point from the next touch, m; in the same order.
    pub errors_m: [Vec<(f64, f64)>; PREDICTORS],
    /// Touched points, m, and their outcomes.
    pub touched_m: Vec<(DVec3, TouchMark)>,
    /// The board at each contact within reach.
    pub boards: Vec<BoardFace>,
    /// The arm during the motion to one of the touches.
    pub arms: Vec<Snapshot>,
    /// Hand to the predicted point, m.
    pub hand_distance_m: Vec<(f64, f64)>,
    /// Board to the predicted point, m.
    pub board_distance_m: Vec<(f64, f64)>,
    /// Start and end of each contact that the renderer felt, s.
    pub contacts_s: Vec<(f64, f64)>,
    /// Start and end of each time in which the hand was lost, s.
    pub lost_s: Vec<(f64, f64)>,
    /// Farthest the wrist reaches from the base axis, m.
    pub reach_m: f64,
}

/// Outcome of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TouchMark {
    /// The board was there before the hand.
    InPlace,
    /// The board was not there in time, though the arm can reach the place.
    Late,
    /// The arm cannot reach the place.
    OutOfReach,
}

/// Predicted points within this distance of the last one are not drawn, m.
const DRAWN_M: f64 = 0.01;

impl Trace {
    /// Ends open spans with the run, and selects the predicted points to draw.
    pub(in crate::run) fn finish(&mut self, end_s: f64, predictions: &[PredictionRecord]) {
        for span in self.contacts_s.iter_mut().chain(&mut self.lost_s) {
            span.1 = span.1.min(end_s);
        }
        for record in predictions {
            for (drawn_m, place) in self.predicted_m.iter_mut().zip(record.likeliest) {
                let Some(place) = place else { continue };
                let last = drawn_m.last();
                if last.is_none_or(|last| last.distance(place.point_m) > DRAWN_M) {
                    drawn_m.push(place.point_m);
                }
            }
        }
    }

    /// Marks the touches, within reach or not, and the distances of the predictions from each.
    pub fn mark_touches(&mut self, outcomes: &[Outcome], predictions: &[PredictionRecord]) {
        let mut since_s = f64::NEG_INFINITY;
        for outcome in outcomes {
            let touch = &outcome.touch;
            let mark = match (outcome.in_place(), outcome.unreachable) {
                (true, _) => TouchMark::InPlace,
                (false, None) => TouchMark::Late,
                (false, Some(_)) => TouchMark::OutOfReach,
            };
            self.touched_m.push((touch.point_m, mark));
            let before = |p: &&PredictionRecord| since_s < p.t_s && p.t_s <= touch.contact_s;
            for record in predictions.iter().filter(before) {
                for (errors_m, place) in self.errors_m.iter_mut().zip(record.likeliest) {
                    let error_m = place.map(|p| p.point_m.distance(touch.point_m));
                    errors_m.extend(error_m.map(|e| (record.t_s, e)));
                }
            }
            since_s = touch.end_s;
        }
    }
}
