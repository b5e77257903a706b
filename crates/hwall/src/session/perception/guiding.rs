//! From the prediction to the target of the board.

use super::{Intent, Perception};
use crate::session::event::{EventKind, Goal, PredictedContact};
use crate::session::handover::Guidance;
use crate::session::response::Answer;
use hwall_contact::{ContactPrediction, Predictor};
use hwall_haptics::{BoardTarget, PostureTarget};
use hwall_reachability::Presented;

impl<P: Predictor> Perception<P> {
    /// Sets the guidance for the control half.
    pub(super) fn guide(&mut self, predicted: Option<PredictedContact>) {
        let mut guidance = Guidance {
            world_moves: self.world.moves(),
            ..self.newest.person
        };
        let stamp_s = guidance.seen_s;
        // Joints were learnt in a world that has not moved.
        let intent = match self.newest.responds_with {
            Some(_) if self.world.world_from_base().is_some() => Some(Intent::Wait),
            _ => self.newest.intent,
        };
        let posture = self.waiting.posture();
        let posture = posture.map(|q| PostureTarget {
            q,
            prepositions_to: None,
            stamp_s,
        });
        match (intent, predicted) {
            (Some(Intent::Wait), _) if posture.is_some() => {
                guidance.waits = posture;
            }
            (Some(Intent::Preposition), predicted) if posture.is_some() => {
                let prepositions_to =
                    predicted.and_then(|PredictedContact { contact, presented }| {
                        let point_m = match presented {
                            Presented::Nearest(point_m) => point_m,
                            _ => contact.point_m,
                        };
                        self.waiting.near(point_m, contact.normal)
                    });
                guidance.waits = posture.map(|posture| PostureTarget {
                    prepositions_to,
                    ..posture
                });
            }
            // Without a waiting posture, there is no target for unusable joints: the arm holds.
            (Some(Intent::Wait), _) if self.newest.responds_with.is_some() => {}
            (Some(_), Some(predicted)) => self.aim(&mut guidance, predicted),
            // Without a predicted touch, the arm waits if a hand is tracked.
            _ if guidance.fingertip.is_some() => guidance.waits = posture,
            _ => {}
        }
        self.untold = Some(guidance);
    }

    /// Sets the target of the board for a contact.
    fn aim(&mut self, guidance: &mut Guidance, predicted: PredictedContact) {
        let PredictedContact { contact, presented } = predicted;
        let stamp_s = guidance.seen_s;
        let point_m = match presented {
            Presented::Nearest(point_m) => point_m,
            _ => contact.point_m,
        };
        let roll_rad = self.roll_rad(&contact);
        let off_m = point_m.distance(contact.point_m);
        let slack_m = self
            .slack
            .slack_m(&contact, &self.board, &self.in_place)
            .map(|slack_m| (slack_m - off_m).max(0.0));
        let target = BoardTarget {
            point_m,
            normal: contact.normal,
            stamp_s,
            roll_rad,
            behind_m: 0.0,
            slack_m,
            near: self.waiting.near(point_m, contact.normal),
            sooner_within_m: None,
        };
        guidance.answer = self.newest.responds_with.map(|q| {
            let surfaces = (self.barriers.all(), &self.board);
            Answer::of(&q, surfaces, &*self.arm, &mut self.scratch)
        });
        let mut served = target;
        if let Some(answer) = &guidance.answer {
            answer.place(&mut served, &*self.arm);
        }
        guidance.target = Some(served);
        guidance.surface = Some(contact.surface);
        guidance.roughness = contact.roughness;
        guidance.contact_s = contact.time_to_contact_s.map(|time| stamp_s + time.mean_s);
        self.announce(Goal {
            surface: contact.surface,
            target,
            presented,
        });
    }

    /// The roll at which the board feels as rough as the surface, rad.
    fn roll_rad(&mut self, contact: &ContactPrediction) -> Option<f64> {
        #[cfg(feature = "texture")]
        return self
            .levels
            .as_ref()
            .and_then(|levels| levels.roll_rad(&mut self.presenter, contact));
        #[cfg(not(feature = "texture"))]
        {
            let _ = contact;
            None
        }
    }

    fn announce(&mut self, goal: Goal) {
        let place = |goal: &Goal| {
            let BoardTarget {
                point_m,
                normal,
                roll_rad,
                ..
            } = goal.target;
            (goal.surface, point_m, normal, roll_rad)
        };
        // A NaN place is not announced: the control side holds and reports it.
        if !(goal.target.point_m.is_finite() && goal.target.normal.is_finite()) {
            return;
        }
        let last = self.newest.goal;
        if last.is_none_or(|last| place(&last) != place(&goal)) {
            let t_s = self.newest.person.seen_s;
            self.events.push(t_s, EventKind::GoalSet(goal));
        }
        self.newest.goal = Some(goal);
    }
}
