//! What takes long on the arm's side, apart from its steps.

use super::handover::BarrierReceiver;
use hwall_haptics::PlannerConfig;

/// Finds goals and ways for [`Control`](super::Control), which needs no planner to be safe: until there is a new plan it goes on, and
/// can always stop.
///
/// One part of a [`Session`](crate::Session), for a thread of its own: [`Session::split`](crate::Session::split).
pub struct Planner {
    pub(super) barriers: BarrierReceiver,
    /// The renderer's.
    pub(super) planner: Option<hwall_haptics::Planner>,
}

impl Planner {
    /// How much is done in a call, and how many steps ahead plans begin.
    pub const fn set_config(&mut self, config: PlannerConfig) {
        if let Some(planner) = &mut self.planner {
            planner.set_config(config);
        }
    }

    /// Plans for the newest step; was there one? See [`hwall_haptics::Planner::plan`].
    pub fn plan(&mut self) -> bool {
        self.planner.as_mut().is_some_and(|planner| {
            self.barriers.renew(planner);
            planner.plan()
        })
    }
}
