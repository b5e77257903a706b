//! A predictor trained in the frame of a room, for a session in the frame of the arm's base.

use hwall_contact::{ContactPrediction, Predictor, PredictorInput};
use hwall_geometry::Pose;
use hwall_scene::Scene;

/// Transforms the session's input from the frame of the base to that of the room, because the behaviour of a person does not depend on
/// where the arm is installed.
#[derive(Debug, Clone)]
pub(super) struct InRoom<P> {
    predictor: P,
    scene: Scene,
    room_from_base: Pose,
    base_from_room: Pose,
    answers: Vec<ContactPrediction>,
}

impl<P: Predictor> InRoom<P> {
    /// `scene`: in the frame of the room, with the same surfaces as the session's scene; no surface may move.
    pub(super) fn new(predictor: P, scene: Scene, base_from_room: Pose) -> Self {
        Self {
            predictor,
            scene,
            room_from_base: base_from_room.inverse(),
            base_from_room,
            answers: Vec::new(),
        }
    }
}

impl<P: Predictor> Predictor for InRoom<P> {
    fn predict(&mut self, _: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let pose = &self.room_from_base;
        let frame = input.frame.transformed(pose);
        let hand = input.hand.map(|hand| hand.transformed(pose));
        let input = PredictorInput {
            frame: &frame,
            hand: hand.as_ref(),
            gaze: input.gaze.transformed(pose),
        };
        let there = self.predictor.predict(&self.scene, &input).iter();
        self.answers.clear();
        let here = there.map(|contact| contact.transformed(&self.base_from_room));
        self.answers.extend(here);
        &self.answers
    }

    fn is_unfamiliar(&self) -> bool {
        self.predictor.is_unfamiliar()
    }

    fn touched(&mut self, contact_m: glam::DVec3, contact_s: f64) {
        let there_m = self.room_from_base.transform_point(contact_m);
        self.predictor.touched(there_m, contact_s);
    }

    fn reset(&mut self) {
        self.predictor.reset();
    }
}
