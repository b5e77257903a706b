//! Spoiled inputs of a session: one wrong number, and a predictor with injectable faults.

use super::fault::{Fault, Input, Other, Spoiled, to_and_fro};
use glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::ArmState;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, Predictor, PredictorInput,
};
use hwall_scene::Scene;
use hwall_testkit::Sampler;

/// Location of the number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Angle(usize),
    Velocity(usize),
    Torque(usize),
    StateTime,
    FrameTime,
    Palm(usize),
    Tip(usize, usize),
    Head(usize),
    Gaze(usize),
}

/// A number that is replaced, or an offset to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrongNumber {
    place: Place,
    by: f64,
    replaces: bool,
}

/// From impossible to almost unchanged values: rad, rad/s, N m, m or s.
const SIZES: [f64; 14] = [
    f64::NAN,
    f64::INFINITY,
    1e300,
    1e9,
    1000.0,
    130.0,
    20.0,
    1.0,
    0.3,
    0.1,
    0.05,
    0.01,
    1e-3,
    0.0,
];

impl WrongNumber {
    pub(super) fn draw(sampler: &mut Sampler) -> Self {
        let joint = sampler.index(7);
        let axis = sampler.index(3);
        let place = match sampler.index(9) {
            0 => Place::Angle(joint),
            1 => Place::Velocity(joint),
            2 => Place::Torque(joint),
            3 => Place::StateTime,
            4 => Place::FrameTime,
            5 => Place::Palm(axis),
            6 => Place::Tip(sampler.index(5), axis),
            7 => Place::Head(axis),
            _ => Place::Gaze(axis),
        };
        let sign = if sampler.index(2) == 0 { 1.0 } else { -1.0 };
        Self {
            place,
            by: sign * SIZES[sampler.index(SIZES.len())],
            replaces: sampler.index(4) == 0,
        }
    }

    fn spoil(&self, number: Option<&mut f64>) {
        match number {
            Some(number) if self.replaces => *number = self.by,
            Some(number) => *number += self.by,
            None => {}
        }
    }

    pub(super) fn spoil_state(&self, state: &mut ArmState) {
        let torques = state.external_torque.as_mut();
        self.spoil(match self.place {
            Place::Angle(joint) => Some(&mut state.q.0[joint]),
            Place::Velocity(joint) => Some(&mut state.qd.0[joint]),
            Place::Torque(joint) => torques.map(|torques| &mut torques.0[joint]),
            Place::StateTime => Some(&mut state.t_s),
            _ => None,
        });
    }

    pub(super) fn spoil_frame(&self, frame: &mut HandFrame) {
        let (point, axis) = match self.place {
            Place::FrameTime => return self.spoil(Some(&mut frame.t_s)),
            Place::Palm(axis) => (&mut frame.palm_m, axis),
            Place::Tip(finger, axis) => (&mut frame.tips_m[finger], axis),
            Place::Head(axis) => (&mut frame.head_m, axis),
            Place::Gaze(axis) => (&mut frame.gaze, axis),
            _ => return,
        };
        self.spoil(point.as_mut().map(|point| &mut point[axis]));
    }
}

/// A gaze-ray predictor that falls back to the hand; a fault falsifies its predicted points.
pub struct SpoiledPredictor {
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
