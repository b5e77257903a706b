//! Alternatives to following the target: moving along with an object, or a supervisor's request.

use super::{AT_REST_S, Renderer};
use crate::arm::{ArmCommand, ArmState};
use crate::render::step::{Phase, RenderInput};
use crate::render::yielding::beyond;
use crate::safety::SafeRequest;
use hwall_geometry::Wrench;
use hwall_kinematics::{JointTorques, Unreachable};

/// A finger within this distance of the centre of the face keeps the board on a moving object between two pushes, m.
const RIDES_M: f64 = 0.2;
/// A smaller force may be a torque sensor error, and moves no object, N.
const LIGHT_N: f64 = 0.5;

impl Renderer {
    /// Carries out a supervisor's request: stand, withdraw, or yield.
    pub(super) fn supervised(
        &mut self,
        request: Option<SafeRequest>,
        torque: Option<&JointTorques>,
        dt_s: f64,
    ) -> ArmCommand {
        let Self {
            withdrawal,
            follower,
            ..
        } = self;
        let pushed = |bias: JointTorques| torque.map(|torque| beyond(torque, &bias));
        let back = match request {
            Some(SafeRequest::Yield {
                speed_m_per_s,
                bias,
            }) => {
                let torque = pushed(bias.unwrap_or_default());
                Some(withdrawal.give_way(follower, torque.as_ref(), speed_m_per_s, dt_s))
            }
            Some(SafeRequest::Retreat {
                behind_m,
                speed_m_per_s,
                bias,
            }) => {
                let torque = bias.and_then(pushed);
                match withdrawal.is_pushed(&**follower.arm(), torque.as_ref()) {
                    true => {
                        Some(withdrawal.give_way(follower, torque.as_ref(), speed_m_per_s, dt_s))
                    }
                    false => withdrawal.step(follower, behind_m, speed_m_per_s, dt_s),
                }
            }
            _ => None,
        };
        if let Some(q) = back {
            return ArmCommand::Position(q);
        }
        // The arm brakes by itself.
        self.end_withdrawal();
        self.is_detached = true;
        let _ = self.follower.brake(dt_s);
        ArmCommand::Hold
    }

    /// The motion continues from where the board has withdrawn to.
    pub(super) fn end_withdrawal(&mut self) {
        if self.withdrawal.was_pushed() {
            self.cap.begin_slowly();
        }
        if let Some((q, qd)) = self.withdrawal.end() {
            let _ = self.follower.restart(&q, &qd);
        }
    }

    /// No object is under the hand any more; all continue by themselves.
    pub(super) fn stop_objects(&mut self, state: Option<&ArmState>, dt_s: f64) {
        self.let_go(state);
        if let Some(objects) = &mut self.objects {
            objects.go_on(dt_s);
        }
    }

    /// The board leaves its object; its motion continues from there, or from the measured state if torques moved the arm.
    pub(super) fn let_go(&mut self, state: Option<&ArmState>) {
        let Some(objects) = &mut self.objects else {
            return;
        };
        let by_torques = objects.by_torques();
        let Some((q, qd)) = objects.release() else {
            return;
        };
        let measured = state.filter(|_| by_torques);
        let (q, qd) = measured.map_or((q, qd), |state| (state.q, state.qd));
        let _ = self.follower.restart(&q, &qd);
    }

    /// Does the board stay on the object that it was pushed on? A push may be too light to begin a touch, and a finger will meet a door that ran
    /// ahead of it again: the board stays until the finger leaves.
    pub(super) fn rides(&self, input: &RenderInput<'_>, state: &ArmState) -> bool {
        let touched = self.touched_object();
        touched.is_some()
            && touched == input.object
            && input.person_m.iter().any(|point| {
                let face = self.arm().forward(&state.q);
                point.distance(face.position_m()) <= RIDES_M
            })
    }

    /// Touched on its way to an object, the board first comes to rest before it follows the object or slides: joints cannot stop at once.
    pub(super) fn comes_to_rest(&self, input: &RenderInput<'_>) -> bool {
        self.objects.is_some()
            && input.object.is_some()
            && self.touched_object().is_none()
            && self.follower.stop_s() > AT_REST_S
    }

    /// The command that moves along with a touched object; `None` without one.
    pub(super) fn along_with_object(
        &mut self,
        phase: Phase,
        input: &RenderInput<'_>,
        state: &ArmState,
        wrench: Option<Wrench>,
        dt_s: f64,
    ) -> Option<(ArmCommand, Option<Unreachable>, bool)> {
        let rides = self.rides(input, state);
        let comes_to_rest = self.comes_to_rest(input);
        let objects = self.objects.as_mut()?;
        let is_contact = matches!(phase, Phase::Contact { .. });
        let rides = matches!(phase, Phase::NonContact) && rides;
        let wrench = if is_contact || self.felt_n >= LIGHT_N {
            wrench
        } else {
            Some(Wrench::default())
        };
        let touched = input
            .object
            .filter(|_| (is_contact || rides) && !comes_to_rest);
        let rendered = match (touched, wrench) {
            (Some(index), Some(wrench)) if dt_s > 0.0 => {
                let q = self.follower.commanded();
                let slide = input.slide.filter(|_| is_contact);
                objects.render(index, &q, state, (&wrench, slide), dt_s)
            }
            _ => None,
        };
        objects.go_on(dt_s);
        match rendered {
            Some(Ok(step)) => {
                let slides = is_contact && input.slide.is_some_and(|s| s.validate().is_ok());
                let slides = slides && step.unreachable.or(step.cannot_slide).is_none();
                Some((step.command, step.unreachable, slides))
            }
            Some(Err(_)) => Some((ArmCommand::Hold, None, false)),
            None if touched.is_some() && objects.touched().is_some() => {
                Some((ArmCommand::Hold, None, false))
            }
            None => {
                self.let_go(Some(state));
                None
            }
        }
    }
}
