//! How the hypotheses of a bank branch, and how their number stays small.

use crate::Bank;
use crate::bank::{Hypothesis, Mode, exchange};

/// Hypotheses lighter than this are dropped.
const NEGLIGIBLE: f64 = 1e-7;
/// Hypotheses of one mode and component are one if their means are closer than this, in squared
/// standard deviations of the heavier, ...
const SAME_MEAN: f64 = 0.25;
/// ... and no diagonal entry of their square roots differs by more than this, as a logarithm.
const SAME_SPREAD: f64 = 0.3;

/// What may have happened in a hypothesis since the last branching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Turn {
    None,
    Pause,
    Resume,
    ChangeOfMind,
}

/// A hypothesis that may be kept.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    from: usize,
    turn: Turn,
    /// Component it has afterwards.
    component: usize,
    weight: f64,
}

/// Share of a motion in which no component is dropped for want of room.
const SETTLING: f64 = 0.1;

impl Bank {
    /// Lets every hypothesis take a turn within a `share` of a motion, and keeps the most probable.
    pub(crate) fn branch(&mut self, share: f64) {
        let at_least_one = |rate: f64| 1.0 - (-rate * share).exp();
        let pause = at_least_one(self.config.pauses);
        let change = (1.0 - pause) * at_least_one(self.config.changes);
        let resume = at_least_one(1.0 / self.config.pause_length);
        self.candidates.clear();
        for (from, h) in self.hypotheses.iter().enumerate() {
            let mut add = |turn, component, probability: f64| {
                self.candidates.push(Candidate {
                    from,
                    turn,
                    component,
                    weight: h.weight * probability,
                });
            };
            match h.mode {
                Mode::Moving => {
                    add(Turn::None, h.component, 1.0 - pause - change);
                    add(Turn::Pause, h.component, pause);
                    for (component, prior) in self.priors.iter().enumerate() {
                        add(Turn::ChangeOfMind, component, change * prior);
                    }
                }
                Mode::Resting => {
                    add(Turn::None, h.component, 1.0 - resume);
                    add(Turn::Resume, h.component, resume);
                }
            }
        }
        self.candidates
            .sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
        let heaviest = self.candidates[0].weight;
        self.candidates.truncate(self.most());
        self.candidates.retain(|c| c.weight > NEGLIGIBLE * heaviest);
        let parents = self.hypotheses.len();
        for h in &mut self.hypotheses {
            h.weight = 0.0;
        }
        for at in 0..self.candidates.len() {
            let candidate = self.candidates[at];
            if candidate.turn == Turn::None {
                self.hypotheses[candidate.from].weight = candidate.weight;
            } else {
                self.turn(candidate);
            }
        }
        // From behind, so that what is swapped in has been looked at.
        for at in (0..parents).rev() {
            if self.hypotheses[at].weight == 0.0 {
                self.discard(at);
            }
        }
        self.merge();
        let sum: f64 = self.hypotheses.iter().map(|h| h.weight).sum();
        for h in &mut self.hypotheses {
            h.weight /= sum;
        }
    }

    /// Most hypotheses at this time.
    pub(crate) fn most(&self) -> usize {
        if self.elapsed < SETTLING {
            self.config.hypotheses.max(2 * self.priors.len())
        } else {
            self.config.hypotheses
        }
    }

    /// Adds the hypothesis of a turn.
    fn turn(&mut self, candidate: Candidate) {
        let component = candidate.component;
        let (mode, changes) = match candidate.turn {
            Turn::Pause => (Mode::Resting, false),
            turn => (Mode::Moving, turn == Turn::ChangeOfMind),
        };
        let mut belief = match self.spare.pop() {
            Some(belief) => belief,
            None => self.blanks[component].clone(),
        };
        if changes {
            // The shape of the old component means nothing in the new one.
            let parent = &mut self.hypotheses[candidate.from];
            let filter = &mut self.filters[parent.component];
            exchange(filter, &mut parent.belief);
            let mean = [filter.phase(), filter.phase_velocity()];
            let covariance = filter.phase_covariance();
            exchange(filter, &mut parent.belief);
            belief.copy_from(&self.blanks[component]);
            belief.take_time_of(&parent.belief);
            let filter = &mut self.filters[component];
            exchange(filter, &mut belief);
            filter.begin_with_phase(mean, covariance);
            exchange(filter, &mut belief);
        } else {
            belief.copy_from(&self.hypotheses[candidate.from].belief);
            if candidate.turn == Turn::Resume {
                let filter = &mut self.filters[component];
                exchange(filter, &mut belief);
                filter.redraw_velocity(self.velocities[component]);
                exchange(filter, &mut belief);
            }
        }
        self.hypotheses
            .push(Hypothesis::new(belief, candidate.weight, mode, component));
    }

    fn discard(&mut self, at: usize) {
        let dropped = self.hypotheses.swap_remove(at);
        self.spare.push(dropped.belief);
    }

    /// Gives the weight of a hypothesis to a heavier one that says the same.
    fn merge(&mut self) {
        self.hypotheses
            .sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
        let mut lighter = 1;
        while lighter < self.hypotheses.len() {
            match (0..lighter).find(|&heavier| self.say_the_same(heavier, lighter)) {
                Some(heavier) => {
                    self.hypotheses[heavier].weight += self.hypotheses[lighter].weight;
                    let dropped = self.hypotheses.remove(lighter);
                    self.spare.push(dropped.belief);
                }
                None => lighter += 1,
            }
        }
    }

    fn say_the_same(&mut self, heavier: usize, lighter: usize) -> bool {
        let (a, b) = (&self.hypotheses[heavier], &self.hypotheses[lighter]);
        if (a.mode, a.component) != (b.mode, b.component) {
            return false;
        }
        let away = &mut self.filters[a.component].scratch.padded;
        for ((d, x), y) in away
            .as_flattened_mut()
            .iter_mut()
            .zip(a.belief.state.as_flattened())
            .zip(b.belief.state.as_flattened())
        {
            *d = x - y;
        }
        a.belief
            .root
            .differs_by_at_most(&b.belief.root, SAME_SPREAD)
            && a.belief.root.distance_squared(away) < SAME_MEAN
    }
}
