//! A predictor with injectable faults.

use super::fault::{Fault, Input, Other, Spoiled, to_and_fro};
use glam::DVec3;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, Predictor, PredictorInput,
};
use hwall_scene::Scene;

/// A gaze-ray predictor that falls back to the hand; a fault falsifies its predicted points.
pub(super) struct SpoiledPredictor {
    sound: DeterministicPredictor,
    answers: Vec<ContactPrediction>,
    frozen: Vec<ContactPrediction>,
    /// The fault, and its duration so far, s.
    pub(super) fault: Option<(Fault, f64)>,
}

/// In front of the arm's own base, base frame, m.
const BASE_M: DVec3 = DVec3::new(0.16, 0.0, 0.3);

impl SpoiledPredictor {
    pub(super) fn new() -> anyhow::Result<Self> {
        Ok(Self {
            sound: DeterministicPredictor::new(DeterministicConfig::ray_led())?,
            answers: Vec::new(),
            frozen: Vec::new(),
            fault: None,
        })
    }
}

impl Predictor for SpoiledPredictor {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let answers = self.sound.predict(scene, input);
        self.answers.clear();
        self.answers.extend_from_slice(answers);
        let Some((fault, since_s)) = self.fault else {
            self.frozen.clone_from(&self.answers);
            return &self.answers;
        };
        let mut put = |point: &dyn Fn(DVec3) -> DVec3| {
            for answer in &mut self.answers {
                answer.point_m = point(answer.point_m);
            }
        };
        match fault {
            Fault::Spoiled(Input::Target, kind) => match kind {
                Spoiled::Missing => self.answers.clear(),
                Spoiled::Frozen => self.answers.clone_from(&self.frozen),
                Spoiled::NotANumber => put(&|_| DVec3::NAN),
                Spoiled::Jumping => {
                    let off_m = DVec3::Y * 0.2 * to_and_fro(since_s);
                    put(&|at| at + off_m);
                }
                Spoiled::Stale => {}
            },
            Fault::Other(Other::SelfCollision) => put(&|_| BASE_M),
            _ => {}
        }
        &self.answers
    }
}
