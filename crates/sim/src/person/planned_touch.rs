//! One planned touch: hand path, gaze and times.

use super::config::PersonConfig;
use super::gaze::Fixation;
use super::glances::Glance;
use super::reach::{Approach, ReachPath};
use glam::DVec3;

/// Planned times of a touch, before the surface crossings are computed, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timeline {
    pub(super) look_s: f64,
    pub(super) start_s: f64,
    pub(super) press_s: f64,
    pub(super) withdraw_s: f64,
    pub(super) end_s: f64,
}

impl Timeline {
    /// Normalised time along the path: 0 at rest, 1 pressing.
    pub(super) fn tau(&self, t_s: f64) -> f64 {
        if t_s <= self.press_s {
            ((t_s - self.start_s) / (self.press_s - self.start_s)).max(0.0)
        } else {
            (1.0 - (t_s - self.withdraw_s) / (self.end_s - self.withdraw_s)).clamp(0.0, 1.0)
        }
    }

    pub(super) fn on_the_way_s(&self, tau: f64) -> f64 {
        self.start_s + tau * (self.press_s - self.start_s)
    }

    /// When a hand without tremor would reach the surface.
    pub(super) fn contact_s(&self, path: &ReachPath) -> f64 {
        self.on_the_way_s(path.tau_contact())
    }

    /// When the hand switches to another target, if it does.
    pub(super) fn switch_s(&self, approach: &Approach) -> Option<f64> {
        let (_, share) = approach.meant.as_ref()?;
        Some(self.on_the_way_s(share * approach.path.tau_contact()))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlannedTouch {
    pub(super) approach: Approach,
    /// The path to the next rest, reversed.
    pub(super) back: ReachPath,
    pub(super) timeline: Timeline,
    pub(super) depth_m: f64,
    /// Direction of the extended fingers at contact, and at the contact meant first.
    pub(super) fingers: DVec3,
    pub(super) fingers_meant: Option<DVec3>,
    /// Fixations, from the first glance of the preceding pause on.
    pub(super) gaze: Vec<Fixation>,
    pub(super) gaze_missed: bool,
    /// When the gaze lands on the target, s.
    pub(super) landed_s: Option<f64>,
    pub(super) glances: [Option<Glance>; PersonConfig::MOST_GLANCES],
}

impl PlannedTouch {
    pub(super) fn is_back(&self, t_s: f64) -> bool {
        t_s > self.timeline.press_s
    }

    pub(super) fn tip_m(&self, t_s: f64) -> DVec3 {
        let tau = self.timeline.tau(t_s);
        if self.is_back(t_s) {
            self.back.tip_m(tau)
        } else {
            self.approach.tip_m(tau)
        }
    }

    /// The current path, and the progress of the change of mind.
    pub(super) fn way(&self, t_s: f64) -> (&ReachPath, f64) {
        if self.is_back(t_s) {
            (&self.back, 1.0)
        } else {
            let tau = self.timeline.tau(t_s);
            (&self.approach.path, self.approach.changed(tau))
        }
    }
}
