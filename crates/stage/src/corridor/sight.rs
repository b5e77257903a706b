//! What the base knows about the person: tracker data on the floor plan of the corridor.

use glam::DVec2;
use hwall::arrival::base::SeenHand;
use hwall_hand::HandFrame;
use std::collections::VecDeque;

/// The velocity of a person is the mean over this time, s.
const VELOCITY_S: f64 = 0.1;

/// The latest heads, and the points of the hand where they were last seen.
#[derive(Default)]
pub(super) struct Sight {
    /// Time, s, and place, m.
    heads: VecDeque<(f64, DVec2)>,
    hand: [Option<(f64, DVec2)>; 6],
}

impl Sight {
    /// Takes a frame. Frames must be in order.
    pub(super) fn see(&mut self, frame: &HandFrame) {
        if let Some(head_m) = frame.head_m {
            self.heads.push_back((frame.t_s, head_m.truncate()));
        }
        let old = |at: &(f64, DVec2)| at.0 < frame.t_s - VELOCITY_S - 1e-9;
        while self.heads.len() > 1 && self.heads.front().is_some_and(old) {
            self.heads.pop_front();
        }
        for (last, now) in self.hand.iter_mut().zip(frame.points()) {
            *last = now.map(|m| (frame.t_s, m.truncate())).or(*last);
        }
    }

    /// The head, m, its velocity, m/s, and the age of the newest sample as of a time, s; NaN where unknown.
    pub(super) fn person(&self, t_s: f64) -> ([DVec2; 2], f64) {
        let ends = self.heads.front().zip(self.heads.back());
        ends.map_or(([DVec2::NAN; 2], f64::NAN), |(first, last)| {
            // A single head gives 0/0.
            let velocity = (last.1 - first.1) / (last.0 - first.0);
            ([last.1, velocity], t_s - last.0)
        })
    }

    /// The points of the hand as of a time, s.
    pub(super) fn hands(&self, t_s: f64) -> Vec<SeenHand> {
        let seen = self.hand.iter().flatten();
        let aged = seen.map(|&(seen_s, at_m)| SeenHand {
            at_m,
            age_s: t_s - seen_s,
        });
        aged.collect()
    }
}
