//! The slow work of the arm's side, apart from its steps.

use super::handover::BarrierReceiver;
use super::worker::Worker;
use hwall_haptics::PlannerConfig;

/// Finds goals and paths for [`Control`](super::Control). Control is safe without a planner: until there is a new plan it continues, and it
/// can always stop.
///
/// One part of a [`Session`](crate::Session), which can run on its own thread: [`Session::split`](crate::Session::split).
#[derive(Default)]
pub struct Planner {
    /// The renderer's planner, and its source of surfaces. `None`: lost with its thread.
    pub(super) parts: Option<(hwall_haptics::Planner, BarrierReceiver)>,
}

impl Planner {
    /// Sets how much work a call does, and how many steps ahead plans begin.
    pub const fn set_config(&mut self, config: PlannerConfig) {
        if let Some((planner, _)) = &mut self.parts {
            planner.set_config(config);
        }
    }

    /// Plans for the newest step; returns whether there was one. See [`hwall_haptics::Planner::plan`].
    pub fn plan(&mut self) -> bool {
        if self.listen().is_none() {
            return false;
        }
        self.work();
        self.tell();
        true
    }

    /// First of the three parts of [`plan`](Self::plan), as a replay needs them: [`hwall_haptics::Planner::listen`].
    pub fn listen(&mut self) -> Option<u64> {
        self.parts.as_mut()?.0.listen()
    }

    /// Is this the newest step with a request?
    #[must_use]
    pub fn is_asked_about(&self, step: u64) -> bool {
        let parts = self.parts.as_ref();
        parts.is_some_and(|(planner, _)| planner.is_asked_about(step))
    }

    /// Second part, with the current surfaces: [`hwall_haptics::Planner::work`].
    pub fn work(&mut self) {
        if let Some((planner, barriers)) = &mut self.parts {
            barriers.renew(planner);
            planner.work();
        }
    }

    /// Third part: [`hwall_haptics::Planner::tell`].
    pub fn tell(&mut self) {
        if let Some((planner, _)) = &mut self.parts {
            planner.tell();
        }
    }
}

/// The planner, here or on another thread.
pub(super) enum Planning {
    Here(Box<Planner>),
    OnThread(Worker<Planner>),
}
