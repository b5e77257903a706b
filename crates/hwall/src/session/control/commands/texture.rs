//! How a touched board moves so that it feels rough.

use super::Control;
use crate::session::control::state::SessionState;
use crate::session::event::EventKind;
use crate::texture::{SurfaceMotion, TextureInput};
use hwall_haptics::{ArmCommand, ArmState, ObjectPath, RenderStep, Slide};

impl Control {
    /// How a touched board slides in its plane, according to the state after the last step.
    pub(super) fn slide(&mut self, now_s: f64, state: &ArmState) -> Option<Slide> {
        // A lost hand, or guidance that is too old, ends the slide.
        let heard = self
            .guidance
            .target
            .is_some_and(|target| (now_s - target.stamp_s).abs() <= self.max_guidance_age_s);
        let touched = heard && self.contact.is_some_and(|contact| !contact.world_moved);
        // While the arm brakes, the slide pauses.
        let stands = |s| matches!(s, SessionState::Holding(_) | SessionState::Safe(_));
        let holds = |step: RenderStep| step.command == ArmCommand::Hold;
        let braking = touched && (stands(self.state) || self.step.is_some_and(holds));
        let surface_motion = self.surface_motion();
        let guidance = &self.guidance;
        let texture = self.texture.as_mut()?;
        if braking || !now_s.is_finite() || state.validate().is_err() {
            return None;
        }
        let step = texture.step(
            now_s,
            &state.q,
            &self.renderer.arm().forward(&state.q),
            &TextureInput {
                touched,
                surface: guidance.surface,
                roughness: guidance.roughness,
                fingertip: guidance.fingertip,
                gesture: guidance.gesture,
                surface_motion,
            },
        );
        if let Some(touch) = step.started {
            self.events.push(now_s, EventKind::TextureStarted(touch));
        }
        if step.ended {
            self.events.push(now_s, EventKind::TextureEnded);
        }
        step.slide
    }

    /// Motion of the touched panel or drawer, as of the last step. A door turns its board with it.
    fn surface_motion(&self) -> SurfaceMotion {
        let renderer = &self.renderer;
        let touched = renderer.touched_object();
        let Some(rendered) = touched.and_then(|index| renderer.objects().get(index)) else {
            return SurfaceMotion::default();
        };
        let ObjectPath::Sliding { direction } = rendered.path else {
            return SurfaceMotion::default();
        };
        SurfaceMotion {
            by_m: direction * (rendered.object.position() - self.touched_at),
            velocity_m_per_s: direction * rendered.object.velocity(),
        }
    }
}
