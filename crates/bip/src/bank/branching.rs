//! Branching of hypotheses, and the limit on their number.

use super::component::ComponentFilter;
use super::config::BankConfig;
use super::hypothesis::{Hypothesis, Mode};
use crate::error::BipError;
use crate::filter::{PhaseEstimate, Posterior};
use crate::model::PhaseVelocity;

/// Hypotheses with a lower weight are dropped.
const NEGLIGIBLE: f64 = 1e-7;

/// Event in a hypothesis since the last branching.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    None,
    Pause,
    Resume,
    /// A gradual stop or start begins.
    ChangeOfSpeed,
    ChangeOfMind,
}

/// Mean duration of a gradual stop or start, as a share of a motion: about a tenth of a second of a reach.
pub(super) const CHANGE_OF_SPEED: f64 = 0.1;

/// Share of the stops and starts that are gradual.
const GRADUAL: f64 = 0.5;

/// Initial velocity of a gradual start, as a share of the mean velocity: mean and standard deviation.
const STARTS_WITH: f64 = 0.25;

/// A hypothesis that may be kept.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    from: usize,
    event: Event,
    /// Component after the event.
    component: usize,
    weight: f64,
}

/// Number of hypotheses to keep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub any: usize,
    /// Additional places for hypotheses that joined the motion under way and have not branched since: one sample cannot distinguish a late phase
    /// from another shape. Their branches get none of these places, because they would fill them all.
    pub joining: usize,
}

impl Room {
    pub(super) fn total(self) -> usize {
        self.any.saturating_add(self.joining)
    }

    /// Takes a place if one is free.
    fn take(&mut self, joins: bool) -> bool {
        let places = match self.any {
            0 if joins => &mut self.joining,
            _ => &mut self.any,
        };
        let free = *places > 0;
        *places -= usize::from(free);
        free
    }
}

/// All hypotheses, with scratch allocated once.
#[derive(Debug)]
pub(super) struct Hypotheses {
    pub list: Vec<Hypothesis>,
    /// Posteriors of dropped hypotheses, for reuse.
    spare: Vec<Posterior>,
    /// A posterior of the component of largest rank; all others are copied from it, so that each has capacity for any component.
    largest: Posterior,
    candidates: Vec<Candidate>,
}

impl Clone for Hypotheses {
    /// Keeps the capacity, so that steps of a copy allocate no more than those of the original.
    fn clone(&self) -> Self {
        let mut list = Vec::with_capacity(self.list.capacity());
        list.extend(
            self.list
                .iter()
                .map(|h| h.with(roomy(&self.largest, &h.posterior))),
        );
        let mut spare = Vec::with_capacity(self.spare.capacity());
        spare.resize(self.spare.len(), self.largest.clone());
        Self {
            list,
            spare,
            largest: self.largest.clone(),
            candidates: Vec::with_capacity(self.candidates.capacity()),
        }
    }
}

/// A copy of a posterior with the capacity of a larger one.
fn roomy(largest: &Posterior, posterior: &Posterior) -> Posterior {
    let mut copy = largest.clone();
    copy.copy_from(posterior);
    copy
}

impl Hypotheses {
    /// At least one component is required.
    pub(super) fn new(
        mut list: Vec<Hypothesis>,
        components: &[ComponentFilter],
        most: usize,
    ) -> Self {
        let capacity = most.max(list.len());
        let blanks = components.iter().map(|c| &c.blank);
        let largest = blanks.max_by_key(|b| b.size());
        let largest = largest.unwrap_or(&components[0].blank).clone();
        for h in &mut list {
            h.posterior = roomy(&largest, &h.posterior);
        }
        // Parents and children are in the list at the same time, and each dropped hypothesis is kept for reuse.
        list.reserve(2 * capacity);
        let mut spare = Vec::with_capacity(4 * capacity);
        spare.resize(2 * capacity, largest.clone());
        Self {
            list,
            spare,
            largest,
            candidates: Vec::with_capacity((3 + components.len()).saturating_mul(capacity)),
        }
    }

    /// Copies the state of other hypotheses of the same components, reusing its own posteriors.
    pub(super) fn copy_from(&mut self, other: &Self) {
        while let Some(last) = self.list.len().checked_sub(1) {
            self.discard(last);
        }
        for theirs in &other.list {
            let mut posterior = self.blank();
            posterior.copy_from(&theirs.posterior);
            self.list.push(theirs.with(posterior));
        }
    }

    /// A posterior with capacity for any component.
    pub(super) const fn largest(&self) -> &Posterior {
        &self.largest
    }

    /// A posterior to overwrite.
    fn blank(&mut self) -> Posterior {
        match self.spare.pop() {
            Some(posterior) => posterior,
            None => self.largest.clone(),
        }
    }

    pub(super) fn heaviest(&self) -> Option<&Hypothesis> {
        self.list
            .iter()
            .max_by(|a, b| a.weight.total_cmp(&b.weight))
    }

    /// Applies every possible event to each hypothesis within a `share` of a motion, and keeps the most probable hypotheses that fit.
    pub(super) fn branch(
        &mut self,
        share: f64,
        room: Room,
        config: &BankConfig,
        components: &mut [ComponentFilter],
    ) {
        self.list_candidates(share, config, components);
        self.candidates
            .sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
        let heaviest = self.candidates[0].weight;
        let (list, mut left) = (&self.list, room);
        self.candidates.retain(|c| {
            let joins = c.event == Event::None && list[c.from].joins;
            c.weight > NEGLIGIBLE * heaviest && left.take(joins)
        });
        let parents = self.list.len();
        for h in &mut self.list {
            h.weight = 0.0;
        }
        for at in 0..self.candidates.len() {
            let candidate = self.candidates[at];
            if candidate.event == Event::None {
                self.list[candidate.from].weight = candidate.weight;
            } else {
                self.add(candidate, components);
            }
        }
        // Backwards, so that swapped-in elements have been visited.
        for at in (0..parents).rev() {
            if self.list[at].weight == 0.0 {
                self.discard(at);
            }
        }
        self.merge(components);
        let sum: f64 = self.list.iter().map(|h| h.weight).sum();
        for h in &mut self.list {
            h.weight /= sum;
        }
    }

    fn list_candidates(&mut self, share: f64, config: &BankConfig, components: &[ComponentFilter]) {
        let at_least_one = |rate: f64| 1.0 - (-rate * share).exp();
        let pause = at_least_one(config.pauses);
        let change = (1.0 - pause) * at_least_one(config.changes);
        let resume = at_least_one(1.0 / config.pause_length);
        // A change of speed ends either at rest or at full speed.
        let settled = at_least_one(1.0 / CHANGE_OF_SPEED);
        self.candidates.clear();
        for (from, h) in self.list.iter().enumerate() {
            let mut list = |event, component, probability: f64| {
                self.candidates.push(Candidate {
                    from,
                    event,
                    component,
                    weight: h.weight * probability,
                });
            };
            match h.mode {
                Mode::Moving => {
                    list(Event::None, h.component, 1.0 - pause - change);
                    list(Event::Pause, h.component, (1.0 - GRADUAL) * pause);
                    list(Event::ChangeOfSpeed, h.component, GRADUAL * pause);
                    for (component, c) in components.iter().enumerate() {
                        list(Event::ChangeOfMind, component, change * c.probability);
                    }
                }
                Mode::Resting => {
                    list(Event::None, h.component, 1.0 - resume);
                    list(Event::Resume, h.component, (1.0 - GRADUAL) * resume);
                    list(Event::ChangeOfSpeed, h.component, GRADUAL * resume);
                }
                Mode::ChangingSpeed => {
                    list(Event::None, h.component, 1.0 - settled);
                    list(Event::Pause, h.component, 0.5 * settled);
                    list(Event::Resume, h.component, 0.5 * settled);
                }
            }
        }
    }

    /// Adds the hypothesis that results from an event.
    fn add(&mut self, candidate: Candidate, components: &mut [ComponentFilter]) {
        let component = candidate.component;
        let mode = match candidate.event {
            Event::Pause => Mode::Resting,
            Event::ChangeOfSpeed => Mode::ChangingSpeed,
            Event::None | Event::Resume | Event::ChangeOfMind => Mode::Moving,
        };
        let mut posterior = self.blank();
        let parent = &mut self.list[candidate.from];
        let rested = parent.mode == Mode::Resting;
        if candidate.event == Event::ChangeOfMind {
            // The coefficients of the old component are meaningless in the new one.
            let phase: PhaseEstimate = components[parent.component]
                .with(&mut parent.posterior, |filter| filter.phase_estimate());
            posterior.copy_from(&components[component].blank);
            posterior.copy_time_from(&parent.posterior);
            posterior.begin_with_phase(&phase);
        } else {
            posterior.copy_from(&parent.posterior);
            let nominal = components[component].velocity;
            match candidate.event {
                Event::Resume if rested => posterior.redraw_velocity(nominal),
                Event::ChangeOfSpeed if rested => {
                    let slow = STARTS_WITH * nominal.mean;
                    posterior.redraw_velocity(PhaseVelocity {
                        mean: slow,
                        variance: slow.powi(2),
                    });
                }
                _ => {}
            }
        }
        let hypothesis = Hypothesis::new(posterior, candidate.weight, mode, component);
        self.list.push(hypothesis);
    }

    fn discard(&mut self, at: usize) {
        let dropped = self.list.swap_remove(at);
        self.spare.push(dropped.posterior);
    }

    /// Merges a hypothesis into a heavier one that is nearly the same.
    fn merge(&mut self, components: &mut [ComponentFilter]) {
        let list = &mut self.list;
        list.sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
        let mut lighter = 1;
        while lighter < list.len() {
            let same = (0..lighter).find(|&heavier| {
                let (a, b) = (&list[heavier], &list[lighter]);
                (a.mode, a.component) == (b.mode, b.component)
                    && components[a.component]
                        .filter
                        .are_alike(&a.posterior, &b.posterior)
            });
            match same {
                Some(heavier) => {
                    list[heavier].weight += list[lighter].weight;
                    self.spare.push(list.remove(lighter).posterior);
                }
                None => lighter += 1,
            }
        }
    }

    /// Turns scores into weights, drops impossible hypotheses and returns the logarithm of the sum of the weights.
    ///
    /// # Errors
    /// All hypotheses are impossible: returns the given failure if there is one, otherwise an overflow. The weights stay unchanged.
    pub(super) fn adopt_scores(&mut self, failed: Option<BipError>) -> Result<f64, BipError> {
        let scores = self.list.iter().map(|h| h.score);
        // NaN counts as impossible: `max` skips it, and its weight becomes zero below.
        let best = scores.fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            let phase = self.heaviest().map_or(0.0, |h| h.posterior.phase());
            return Err(failed.unwrap_or(BipError::Overflow { phase }));
        }
        let mut sum = 0.0;
        for h in &mut self.list {
            let weight = (h.score - best).exp();
            h.weight = if weight.is_nan() { 0.0 } else { weight };
            sum += h.weight;
        }
        let mut at = 0;
        while at < self.list.len() {
            if self.list[at].weight > 0.0 {
                self.list[at].weight /= sum;
                at += 1;
            } else {
                self.discard(at);
            }
        }
        Ok(best + sum.ln())
    }
}
