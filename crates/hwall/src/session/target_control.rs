//! A controller with a given target.

use super::drive::Controller;
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, HapticsError, RenderInput, RenderStep, Renderer,
    RendererConfig, Slide,
};
use hwall_kinematics::ArmKinematics;

/// A controller with a given target: for a teacher's arm, a calibration, an experiment with the arm alone. It works like a
/// [`Session`](crate::Session) without hand and prediction, and runs in the same loop, [`drive`](crate::drive).
pub struct TargetControl {
    renderer: Renderer,
    step: Option<RenderStep>,
    /// The target of the board, stamped on the arm's clock; `None`: the arm holds.
    pub target: Option<BoardTarget>,
    /// How the board moves within its plane while it is touched; `None`: it stands still.
    pub slide: Option<Slide>,
}

impl TargetControl {
    /// For an arm (its tool is replaced by the board's face).
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        arm: &dyn ArmKinematics,
        board: &Board,
        config: RendererConfig,
    ) -> Result<Self, HapticsError> {
        Ok(Self {
            renderer: Renderer::new(arm, board, config)?,
            step: None,
            target: None,
            slide: None,
        })
    }

    /// The last step in full; `None` before the first.
    #[must_use]
    pub const fn last_step(&self) -> Option<&RenderStep> {
        self.step.as_ref()
    }

    /// The renderer, which turns targets and states into commands; its arm has the face of the board as its tool.
    #[must_use]
    pub const fn renderer(&self) -> &Renderer {
        &self.renderer
    }
}

impl Controller for TargetControl {
    fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        let input = RenderInput {
            target: self.target.as_ref(),
            slide: self.slide.as_ref(),
            ..RenderInput::default()
        };
        let step = self.renderer.step_with(now_s, state, &input);
        self.step = Some(step);
        step.command
    }

    fn plan(&mut self) {
        self.renderer.plan();
    }
}
