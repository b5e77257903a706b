//! What takes long on the arm's side, apart from its steps.

use super::handover::BarrierReceiver;
use super::worker::Worker;
use hwall_haptics::PlannerConfig;

/// Finds goals and ways for [`Control`](super::Control), which needs no planner to be safe: until there is a new plan it goes on, and
/// can always stop.
///
/// One part of a [`Session`](crate::Session), for a thread of its own: [`Session::split`](crate::Session::split).
#[derive(Default)]
pub struct Planner {
    /// The renderer's, and where it hears of surfaces. `None`: it was lost with its thread.
    pub(super) parts: Option<(hwall_haptics::Planner, BarrierReceiver)>,
}

impl Planner {
    /// How much is done in a call, and how many steps ahead plans begin.
    pub const fn set_config(&mut self, config: PlannerConfig) {
        if let Some((planner, _)) = &mut self.parts {
            planner.set_config(config);
        }
    }

    /// Plans for the newest step; was there one? See [`hwall_haptics::Planner::plan`].
    pub fn plan(&mut self) -> bool {
        if self.listen().is_none() {
            return false;
        }
        self.work();
        self.tell();
        true
    }

    /// The three parts of [`plan`](Self::plan), as a replay needs them: [`hwall_haptics::Planner::listen`].
    pub fn listen(&mut self) -> Option<u64> {
        self.parts.as_mut()?.0.listen()
    }

    /// Is this the newest step that asks?
    #[must_use]
    pub fn is_asked_about(&self, step: u64) -> bool {
        let parts = self.parts.as_ref();
        parts.is_some_and(|(planner, _)| planner.is_asked_about(step))
    }

    /// Second, with the surfaces of now: [`hwall_haptics::Planner::work`].
    pub fn work(&mut self) {
        if let Some((planner, barriers)) = &mut self.parts {
            barriers.renew(planner);
            planner.work();
        }
    }

    /// Third: [`hwall_haptics::Planner::tell`].
    pub fn tell(&mut self) {
        if let Some((planner, _)) = &mut self.parts {
            planner.tell();
        }
    }
}

/// A planner where it works.
pub(super) enum Planning {
    Here(Box<Planner>),
    OnThread(Worker<Planner>),
}
