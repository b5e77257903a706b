//! One planned touch: hand path, gaze and times.

use super::config::PersonConfig;
use super::gaze::Fixation;
use super::glances::Glance;
use super::profile::minimum_jerk;
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

/// A movement along the surface, added to the reach and zero at the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    along_m: DVec3,
    from_to_s: [f64; 2],
    done_at_contact: f64,
}

impl Stroke {
    pub(super) fn new(along_m: DVec3, from_to_s: [f64; 2], contact_s: f64) -> Self {
        let stroke = Self {
            along_m,
            from_to_s,
            done_at_contact: 0.0,
        };
        Self {
            done_at_contact: stroke.done(contact_s),
            ..stroke
        }
    }

    fn done(&self, t_s: f64) -> f64 {
        let [from_s, to_s] = self.from_to_s;
        minimum_jerk((t_s - from_s) / (to_s - from_s))
    }

    /// Distance from the reach, of which the fraction `approach` is done: zero at both rests.
    fn off_m(&self, t_s: f64, approach: f64, is_back: bool) -> DVec3 {
        let done = self.done(t_s);
        self.along_m
            * match is_back {
                true => (done - self.done_at_contact) * approach,
                false => done - self.done_at_contact * approach,
            }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlannedTouch {
    pub(super) stroke: Option<Stroke>,
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
        let (tau, is_back) = (self.timeline.tau(t_s), self.is_back(t_s));
        let (tip_m, path) = match is_back {
            true => (self.back.tip_m(tau), &self.back),
            false => (self.approach.tip_m(tau), &self.approach.path),
        };
        let off_m = |stroke: &Stroke| stroke.off_m(t_s, path.approach(tau), is_back);
        self.stroke
            .as_ref()
            .map_or(tip_m, |stroke| tip_m + off_m(stroke))
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
