//! Tracking loss recorded as zeros, and tracker properties of a recording.

use super::in_memory::{Quantity, Recording};
use crate::track::{FreezeConfig, FreezeWatch, ValueSteps};
use glam::DVec3;

/// A point that passes the origin does so in steps of similar length; a step more than this many times longer than its neighbour is a loss.
const LONGER: f64 = 3.0;

impl Recording {
    /// Grid step of the hand positions, m: 0.01 for two decimals; 0 if they are not on a grid.
    #[must_use]
    pub fn value_step_m(&self) -> f64 {
        let mut steps = ValueSteps::default();
        for frame in self.frames() {
            let seen = |point: Option<DVec3>| point.filter(|&at_m| at_m != DVec3::ZERO);
            steps.update(&frame.points().map(seen));
        }
        steps.step_m()
    }

    /// Marks samples that repeat a frozen pose, including those before the detection.
    #[must_use]
    pub fn frozen_samples(&self, config: FreezeConfig) -> Vec<bool> {
        let mut frozen = vec![false; self.samples.len()];
        let mut watch = FreezeWatch::new(config);
        for (index, frame) in self.frames().enumerate() {
            let Some(found) = watch.update(frame) else {
                continue;
            };
            for k in (0..=index).rev() {
                // Everything before a marked sample is marked already.
                if self.samples[k].frame.t_s < found.since_s
                    || std::mem::replace(&mut frozen[k], true)
                {
                    break;
                }
            }
        }
        frozen
    }

    /// Treats exact zeros as missing if the quantity is elsewhere before or after them, and counts the affected rows: headsets write zeros for
    /// what they do not see.
    pub(super) fn without_zeros(&mut self) {
        let step_m = self.value_step_m();
        let mut lost = vec![false; self.samples.len()];
        for quantity in Quantity::ALL {
            // A target may be at the origin.
            if quantity != Quantity::Target {
                self.clear_zeros(quantity, step_m, &mut lost);
            }
        }
        self.zero_rows = lost.into_iter().filter(|&is_lost| is_lost).count();
    }

    fn clear_zeros(&mut self, quantity: Quantity, step_m: f64, lost: &mut [bool]) {
        let held = |i: usize| self.samples[i].get(quantity);
        let held: Vec<(usize, DVec3)> = (0..self.samples.len())
            .filter_map(|i| Some((i, held(i)?)))
            .collect();
        let is_zero = |k: usize| held[k].1 == DVec3::ZERO;
        let mut k = 0;
        while k < held.len() {
            let start = k;
            while k < held.len() && is_zero(k) == is_zero(start) {
                k += 1;
            }
            // Compares the step from the zeros to a neighbour with the next step.
            let leaps = |near: Option<usize>, beyond: Option<usize>| {
                let at =
                    |k: Option<usize>| Some(held.get(k?)?.1).filter(|&at_m| at_m != DVec3::ZERO);
                let (Some(near_m), Some(beyond_m)) = (at(near), at(beyond)) else {
                    return false;
                };
                near_m.length() > LONGER * (near_m.distance(beyond_m) + step_m)
            };
            let from_before = leaps(start.checked_sub(1), start.checked_sub(2));
            if is_zero(start) && (from_before || leaps(Some(k), Some(k + 1))) {
                for &(i, _) in &held[start..k] {
                    self.samples[i].set(quantity, None);
                    lost[i] = true;
                }
            }
        }
    }
}
