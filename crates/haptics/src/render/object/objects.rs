//! The moving objects of a scene: one may be under the hand, the others move by themselves.

use super::object_port::PortLedger;
use super::object_rendering::{ObjectRendering, ObjectStep, RenderedObject};
use crate::arm::ArmState;
use crate::error::HapticsError;
use crate::motion::Slide;
use hwall_geometry::Wrench;
use hwall_kinematics::{JointPositions, JointVelocities};

/// All moving objects, and the one that is touched.
#[derive(Debug, Clone)]
pub(in crate::render) struct Objects {
    rendering: ObjectRendering,
    all: Vec<RenderedObject>,
    touched: Option<usize>,
}

impl Objects {
    pub(in crate::render) const fn new(
        rendering: ObjectRendering,
        all: Vec<RenderedObject>,
    ) -> Self {
        Self {
            rendering,
            all,
            touched: None,
        }
    }

    pub(in crate::render) fn all(&self) -> &[RenderedObject] {
        &self.all
    }

    /// The object that the board is on.
    pub(in crate::render) const fn touched(&self) -> Option<usize> {
        self.touched
    }

    /// Is the arm controlled by torques?
    pub(in crate::render) const fn by_torques(&self) -> bool {
        self.rendering.by_torques()
    }

    /// Energy exchanged between hand and board, while the board is on an object.
    pub(in crate::render) fn ledger(&self) -> Option<PortLedger> {
        self.touched.map(|_| *self.rendering.ledger())
    }

    /// Ends the touch: returns the arm's configuration on the object's path and its velocity; `None` if nothing was touched.
    pub(in crate::render) fn release(&mut self) -> Option<(JointPositions, JointVelocities)> {
        let rendered = self.all.get(self.touched.take()?)?;
        let velocity = rendered.object.velocity();
        Some((*self.rendering.q(), self.rendering.qd_at(velocity)))
    }

    /// Advances the objects that are not touched.
    pub(in crate::render) fn go_on(&mut self, dt_s: f64) {
        for (index, rendered) in self.all.iter_mut().enumerate() {
            if self.touched != Some(index) {
                // An object whose motion overflows stands still.
                let _ = rendered.object.step(0.0, dt_s);
            }
        }
    }

    /// One step with the object under the hand; `None` for an invalid index. `q` holds the face on it when the touch begins.
    pub(in crate::render) fn render(
        &mut self,
        index: usize,
        q: &JointPositions,
        state: &ArmState,
        (wrench, slide): (&Wrench, Option<&Slide>),
        dt_s: f64,
    ) -> Option<Result<ObjectStep, HapticsError>> {
        let rendered = self.all.get_mut(index)?;
        if self.touched != Some(index) {
            if let Err(error) = self.rendering.begin(rendered, q) {
                return Some(Err(error));
            }
            self.touched = Some(index);
        }
        self.rendering.set_slide(slide);
        Some(self.rendering.step(rendered, state, wrench, dt_s))
    }
}
